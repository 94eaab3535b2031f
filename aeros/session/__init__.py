"""The one place where a run is put together: site, modules, plant, gate, audit, executor, skills, agent."""
