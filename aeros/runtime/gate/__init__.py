"""The gate: decides each requested action (ALLOW, ATTENUATE or DENY) under the configuration in force."""
