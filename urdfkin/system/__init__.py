"""Access to the operating system: files, the cache on disk, processes, locks, git and installed packages."""
