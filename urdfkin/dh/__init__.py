"""Denavit-Hartenberg tables from any chain, exact, canonical and proven; docs/dh.md has the theory."""

from urdfkin.dh.convert import to_convention
from urdfkin.dh.export import FORMATS, export
from urdfkin.dh.make import dh_table
from urdfkin.dh.read import read_table
from urdfkin.dh.row import Convention, DHRow
from urdfkin.dh.rows import table_from_mapping, table_from_rows
from urdfkin.dh.statement import SnapChange, SnapStatement
from urdfkin.dh.table import DHTable
from urdfkin.dh.to_tree import to_tree, to_urdf
from urdfkin.dh.units import Units, units_of

__all__ = [
    "FORMATS",
    "Convention",
    "DHRow",
    "DHTable",
    "SnapChange",
    "SnapStatement",
    "Units",
    "dh_table",
    "export",
    "read_table",
    "table_from_mapping",
    "table_from_rows",
    "to_convention",
    "to_tree",
    "to_urdf",
    "units_of",
]
