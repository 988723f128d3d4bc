"""Read robot descriptions (URDF, xacro, MJCF) as a `KinematicTree`, and write a tree as URDF.

| Step | Module | Result |
|---|---|---|
| Source | `sources`, `catalogue`, `xacro` | `Text`: the bytes of a URDF and information about their source |
| Parser | `parser` | `Element`, then the `RobotRecord` of `records`; problems are `Finding`s of `findings` |
| Tree | `reader` | `KinematicTree` |
| Writer | `writer` | URDF text |

Two modules read robots in other formats: `mjcf` reads MJCF, and `foreign` reads objects of other libraries.
"""
