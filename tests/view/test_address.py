"""Who may reach the viewer: this machine alone, unless one asks for more."""

from __future__ import annotations

import ipaddress

from urdfkin.cli.view import command


def test_the_viewer_listens_to_this_machine_alone_by_default() -> None:
    (host,) = (option for option in command.params if option.name == "host")
    assert ipaddress.ip_address(str(host.default)).is_loopback
