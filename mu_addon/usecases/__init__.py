"""One run end to end: its folder, its progress, its pictures and its report."""
