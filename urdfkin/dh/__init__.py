"""Derive, compare, convert, read and export Denavit-Hartenberg tables; docs/dh.md explains the theory."""

from urdfkin.dh.convert import to_convention, to_tree, to_urdf
from urdfkin.dh.export import FORMATS, export
from urdfkin.dh.make import make_dh_table
from urdfkin.dh.parse_table import read_table
from urdfkin.dh.rows import table_from_mapping, table_from_rows
from urdfkin.dh.table import DHConvention, DHRow, DHTable, SnapChange, SnapReport
from urdfkin.dh.units import Units, parse_units

__all__ = [
    "FORMATS",
    "DHConvention",
    "DHRow",
    "DHTable",
    "SnapChange",
    "SnapReport",
    "Units",
    "export",
    "make_dh_table",
    "parse_units",
    "read_table",
    "table_from_mapping",
    "table_from_rows",
    "to_convention",
    "to_tree",
    "to_urdf",
]
