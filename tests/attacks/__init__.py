"""What attacks on urdfkin found, each as a claim that failed once: files, names, numbers, signals, people."""
