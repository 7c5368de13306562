# SPDX-License-Identifier: Apache-2.0
"""What drawing takes of a graphics card: one program for all surfaces, few calls and bytes."""

from __future__ import annotations


def test_one_program_draws_and_measures_all_surfaces_of_closed_meshes_and_one_those_of_open_ones(viewer):
    surfaces = {"plaster", "oak", "left glow", "right glow"}
    viewer.show("falseColour")
    programs = viewer.ask("deltalux.cost()")["programs"]
    assert len([name for name in programs if name in surfaces]) == 2


def test_a_frame_takes_few_calls_and_a_vertex_few_bytes(viewer):
    viewer.press("Escape")  # no outline, no arrows
    viewer.settle()
    cost = viewer.ask("deltalux.cost()")
    assert cost["calls"] <= 6  # one for each mesh of one material
    assert cost["bytesOfVertex"] < 45  # 32 of the vertex, 2 for each corner of a triangle


def test_the_first_picture_of_a_baked_scene_is_lit_and_metered(open_page, server):
    """No shapes without light, no picture of another exposure are drawn before it."""
    open_page(server.url).settle()  # the server has encoded its light
    viewer = open_page(server.url)
    viewer.settle()
    assert viewer.ask("deltalux.cost()")["pictures"] == 1
