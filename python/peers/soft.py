#!/usr/bin/env python3
"""Runs MuJoCo's flex on the cubes of `metachron bench soft`, and writes what its steps take.

In: nothing but MuJoCo (`pip install mujoco`). Out: JSON for `metachron bench soft --peers FILE`.
Never here: our own engine.

A cube of 0.1 m, 1.05 kg, 12 kPa, Poisson's ratio 0.4, its bottom held, falls by its weight in steps of 10 ms
until it rests; the time of a step is the median of CPU time over the last steps. MuJoCo divides each cell of
the lattice into tetrahedra, which are stiffer than the cells of metachron: its sag says by how much.
"""

import argparse
import sys
import time

import report

SIZE_M = 0.1
MASS_KG = 1.05
YOUNG_PA = 12e3
POISSON = 0.4
STEP_S = 0.01
# Rayleigh's, of stiffness, s: the cube rests after a second.
DAMPING_S = 0.01
# Nodes along an edge.
EDGES = (5, 7, 9, 11, 13)
SETTLE_STEPS = 80
MEASURED_STEPS = 40
# Wall seconds after which a size is measured over the steps that it has made, and no larger one is begun.
PATIENCE_S = 60.0

CUBE = """
<mujoco>
  <option timestep="{step}" integrator="{integrator}" gravity="0 0 -9.81"/>
  <worldbody>
    <flexcomp name="cube" type="grid" dim="3" count="{n} {n} {n}" spacing="{cell} {cell} {cell}"
              mass="{mass}" radius="0.0001" pos="0 0 {middle}">
      <elasticity young="{young}" poisson="{poisson}" damping="{damping}"/>
      <edge equality="false"/>
      <contact contype="0" conaffinity="0" selfcollide="none"/>
      <pin gridrange="0 0 0 {last} {last} 0"/>
    </flexcomp>
  </worldbody>
</mujoco>
"""


def integrator(mujoco):
    """The integrator that takes elasticity implicitly: `discrete` where there is one, else `implicitfast`."""
    return "discrete" if hasattr(mujoco.mjtIntegrator, "mjINT_DISCRETE") else "implicitfast"


def run(mujoco, nodes_along):
    """One row: the cube of so many nodes along an edge."""
    text = CUBE.format(
        step=STEP_S,
        integrator=integrator(mujoco),
        n=nodes_along,
        last=nodes_along - 1,
        cell=SIZE_M / (nodes_along - 1),
        mass=MASS_KG,
        middle=0.5 * SIZE_M,
        young=YOUNG_PA,
        poisson=POISSON,
        damping=DAMPING_S,
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = data.flexvert_xpos.copy()
    begun = time.monotonic()
    spent_ms = []
    for _ in range(SETTLE_STEPS + MEASURED_STEPS):
        start = time.process_time()
        mujoco.mj_step(model, data)
        spent_ms.append((time.process_time() - start) * 1e3)
        if time.monotonic() - begun > PATIENCE_S:
            break
    if data.time < (len(spent_ms) - 0.5) * STEP_S:
        sys.exit(f"MuJoCo gave up on {nodes_along ** 3} nodes and began again: its time is {data.time} s")
    top = before[:, 2] > before[:, 2].max() - 1e-6 * SIZE_M
    sag_m = float((before[top, 2] - data.flexvert_xpos[top, 2]).mean())
    last_ms = sorted(spent_ms[-MEASURED_STEPS:])
    row = {
        "test": "cube held",
        "nodes": nodes_along**3,
        "ms_a_step": round(last_ms[len(last_ms) // 2], 4),
        "sag_m": round(sag_m, 7),
    }
    return row, time.monotonic() - begun


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("out", nargs="?", help="where the JSON goes; standard output where not given")
    arguments = parser.parse_args()
    mujoco = report.load("mujoco")
    rows = []
    for nodes_along in EDGES:
        row, took_s = run(mujoco, nodes_along)
        rows.append(row)
        print(f"{row['nodes']} nodes: {row['ms_a_step']} ms a step, sag {row['sag_m'] * 1e3:.3f} mm", file=sys.stderr)
        if took_s > PATIENCE_S:
            break
    report.write(f"MuJoCo {report.version('mujoco')}, flex, {integrator(mujoco)}", rows, arguments.out)


if __name__ == "__main__":
    main()
