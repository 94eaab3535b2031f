"""Assembly of a run: site, modules, plant, gate, audit log, executor, skills and agent."""
