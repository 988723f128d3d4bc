"""Rules that check the records of a URDF. A TOML file beside each module describes the module's rules."""
