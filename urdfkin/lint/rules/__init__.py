"""The rules, one module for each topic. A TOML file beside the module has the page of each code."""
