"""Writes arm.json: the joint positions that MuJoCo computes for arm.xml over two seconds, by its Runge-Kutta method of fourth order.

Prints how far MuJoCo's own steps of half a millisecond are from that.

    pip install mujoco && python reference.py
"""

import json
import pathlib

import mujoco

folder = pathlib.Path(__file__).parent
model = mujoco.MjModel.from_xml_path(str(folder / "arm.xml"))
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
names = [model.joint(i).name for i in range(model.njnt)]


def moments(integrator, timestep):
    """The positions of all joints every 0.2 s."""
    model.opt.integrator, model.opt.timestep = integrator, timestep
    data = mujoco.MjData(model)
    found = []
    for _ in range(10):
        for _ in range(round(0.2 / timestep)):
            mujoco.mj_step(model, data)
        found.append({"at_s": round(data.time, 6), "positions": [round(float(q), 9) for q in data.qpos]})
    return found


exact = moments(mujoco.mjtIntegrator.mjINT_RK4, 1e-4)
for name in ["mjINT_EULER", "mjINT_IMPLICITFAST"]:
    for timestep in [1e-3, 5e-4]:
        pairs = zip(moments(getattr(mujoco.mjtIntegrator, name), timestep), exact)
        off = max(abs(a - b) for one, other in pairs for a, b in zip(one["positions"], other["positions"]))
        print(f"{name} at {timestep} s: {off:.2e}")
masses = {model.body(i).name: round(float(model.body(i).mass[0]), 9) for i in range(1, model.nbody)}
answer = {"mujoco": mujoco.__version__, "joints": names, "masses_kg": masses, "moments": exact}
(folder / "arm.json").write_text(json.dumps(answer, indent=1) + "\n")
