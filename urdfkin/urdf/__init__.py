"""Read robot descriptions (URDF, xacro, MJCF, USD) as a `KinematicTree`, and write a tree as URDF.

| Step | Module | Result |
|---|---|---|
| Source | `sources`, `catalogue`, `xacro` | `UrdfText`: the bytes of a URDF and the name of the source |
| Parser | `parser` | `RobotRecord` (in `records`), and a `Finding` (in `findings`) for each problem |
| Check | `lint` | a `Finding` for each further problem |
| Tree | `reader` | `KinematicTree` |
| Writer | `writer` | URDF text |

Three modules read robots in other formats: `mjcf` reads MJCF, `usd` reads USD, and `foreign` reads objects of
other libraries.
"""
