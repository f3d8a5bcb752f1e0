#!/usr/bin/env python3
"""Writes a blueprint for Rerun that shows the labels of `teachtree analyze LOG --mcap FILE.mcap` as lanes, above poses and signals.

    python3 -m venv venv && venv/bin/pip install rerun-sdk==0.41
    venv/bin/python tools/rerun_blueprint.py view.rbl
    venv/bin/rerun mcap convert FILE.mcap --application-id teachtree -o view.rrd && venv/bin/rerun view.rrd view.rbl
"""

import sys

import rerun as rr
import rerun.blueprint as rrb

# Lanes take their states from the texts of messages.
states = rrb.encodings.VisualizerComponentMapping(
    target="StateChange:state",
    source_kind=rrb.encodings.ComponentSourceKind.SourceComponent,
    source_component="TextDocument:text",
)
lanes = [f"/teachtree/{track}/{lane}" for track in ("left", "right", "both") for lane in ("task", "primitive", "object")]
view = rrb.StateTimelineView(
    origin="/teachtree", contents=lanes, name="labels", overrides={lane: rr.StateChange().visualizer(mappings=[states]) for lane in lanes}
)
poses, signals = rrb.Spatial3DView(origin="/", name="poses"), rrb.TimeSeriesView(origin="/teachtree/signal", name="signals")
rrb.Blueprint(rrb.Vertical(poses, view, signals, row_shares=[3, 2, 1])).save("teachtree", sys.argv[1])
