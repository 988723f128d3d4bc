"""What the operating system is asked: files that users name, folders kept between runs, processes, locks."""
