"""Rules that check a URDF. A TOML file beside each module documents the module's rules."""
