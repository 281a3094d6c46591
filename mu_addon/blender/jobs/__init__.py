"""Jobs in child processes: `start_child` starts and watches them, `child_main` runs in them."""
