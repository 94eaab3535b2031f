"""The runtime, which decides and records every action: gate, configuration, executor, monitor and audit."""
