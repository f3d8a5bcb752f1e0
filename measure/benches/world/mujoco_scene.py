"""The scene of main.rs in MuJoCo: prints its steps a second while ten fingertips hold the cube in the air.

A fingertip is a ball of 20 g without weight on three slides, drawn to its target by 300 N/m and 4.9 N s/m, as the virtual coupling draws ours."""
import sys
import time

import mujoco

STEPS = int(sys.argv[1])
SPOTS = [(0.0, 0.060), (0.03, 0.075), (-0.03, 0.075), (0.03, 0.045), (-0.03, 0.045)]
TIPS = [(side * 0.060, y, z) for side in (-1, 1) for y, z in SPOTS]


def fingertip(at):
    slides = "".join(
        f'<joint name="{axis}{at}" type="slide" axis="{" ".join(str(int(axis == other)) for other in "xyz")}"/>'
        for axis in "xyz"
    )
    return f'<body gravcomp="1">{slides}<geom type="sphere" size="0.01" mass="0.02" friction="1"/></body>'


def wall(x, y, size):
    return f'<geom type="box" pos="{x} {y} 0.12" size="{size}" friction="0.4"/>'


MODEL = f"""<mujoco>
<option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10"/>
<worldbody>
<geom type="box" pos="0 0 -0.01" size="0.32 0.3 0.01" friction="0.4"/>
{wall(0.31, 0, "0.01 0.3 0.12")}{wall(-0.31, 0, "0.01 0.3 0.12")}{wall(0, 0.29, "0.3 0.01 0.12")}{wall(0, -0.29, "0.3 0.01 0.12")}
<body pos="0 0 0.06"><freejoint/><geom type="box" size="0.06 0.06 0.06" mass="0.05" friction="0.4"/></body>
{"".join(fingertip(at) for at in range(10))}
</worldbody>
<actuator>{"".join(f'<position joint="{axis}{at}" kp="300" kv="4.9"/>' for at in range(10) for axis in "xyz")}</actuator>
</mujoco>"""

model = mujoco.MjModel.from_xml_string(MODEL)
data = mujoco.MjData(model)
for at, (x, y, z) in enumerate(TIPS):
    outside = 0.075 if x > 0 else -0.075
    data.qpos[7 + 3 * at : 10 + 3 * at] = (outside, y, z)
for step in range(1500):
    lift = 0.05 * min(max(step / 1000 - 0.3, 0.0), 1.0)
    data.ctrl[:] = [number for x, y, z in TIPS for number in (x, y, z + lift)]
    mujoco.mj_step(model, data)
start = time.perf_counter()
mujoco.mj_step(model, data, nstep=STEPS)
took = time.perf_counter() - start
touching = {tuple(sorted((contact.geom1, contact.geom2))) for contact in data.contact[: data.ncon]}
assert len(touching) == 10 and 0.10 < data.qpos[2] < 0.12, f"{len(touching)} touch, the cube is at {data.qpos[2]:.3f} m"
print(STEPS / took)
