"""What mediates every action: gate, configuration, executor, monitor, audit."""
