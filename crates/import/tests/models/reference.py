"""Writes arm.json: the joint positions that MuJoCo computes for arm.xml, by its Runge-Kutta method of fourth order.

    pip install mujoco && python reference.py
"""

import json
import pathlib

import mujoco

folder = pathlib.Path(__file__).parent
model = mujoco.MjModel.from_xml_path(str(folder / "arm.xml"))
model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
model.opt.timestep = 1e-4
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
data = mujoco.MjData(model)
names = [model.joint(i).name for i in range(model.njnt)]
moments = []
for _ in range(5):
    for _ in range(2000):
        mujoco.mj_step(model, data)
    moments.append({"at_s": round(data.time, 6), "positions": [round(float(q), 9) for q in data.qpos]})
masses = {model.body(i).name: round(float(model.body(i).mass[0]), 9) for i in range(1, model.nbody)}
answer = {"mujoco": mujoco.__version__, "joints": names, "masses_kg": masses, "moments": moments}
(folder / "arm.json").write_text(json.dumps(answer, indent=1) + "\n")
