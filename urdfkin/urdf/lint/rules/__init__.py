"""The rules over the records of a URDF. A TOML file beside each module has the pages of its codes."""
