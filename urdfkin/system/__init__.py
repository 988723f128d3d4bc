"""Access to the operating system: files, cache, processes, locks, git, installed packages."""
