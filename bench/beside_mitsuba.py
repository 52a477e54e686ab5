#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""clume beside Mitsuba's volpath: a bundled scenes/smoke_*.json, Mitsuba rendering it baked to voxels, in turns.

    python3 -m venv venv && venv/bin/pip install mitsuba OpenEXR      # and an LLVM of version 17 or later: DRJIT_LIBLLVM_PATH
    clume bake scenes/smoke_point.json --resolution 256 -o smoke.vol
    venv/bin/python bench/beside_mitsuba.py build/release/clume scenes/smoke_point.json smoke.vol [ROUNDS]

Prints per renderer the variance of a sample (over images of different seeds, mean of the pixels and channels), seconds a sample per
pixel of the whole image (wall clock and processor, medians), and what an error of 0.01 (RMSE) takes; then the ratios.
"""
import json
import struct
import subprocess
import sys
import tempfile
import time

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
import drjit as dr
import OpenEXR

clume, path, volume = sys.argv[1:4]
rounds = int(sys.argv[4]) if len(sys.argv) > 4 else 7
scene = json.load(open(path))
camera, film, medium, light = scene["camera"], scene["film"], scene["media"][0], scene["lights"][0]
to_world = mi.ScalarTransform4f

with open(volume, "rb") as f:
    bounds = np.array(struct.unpack("<6f", f.read(48)[24:48]))
low, high = bounds[:3], bounds[3:]
if light["type"] == "point":
    emitter = {"type": "point", "position": light["position"], "intensity": {"type": "rgb", "value": light["intensity"]}}
else:
    emitter = {"type": "constant", "radiance": {"type": "rgb", "value": light["radiance"]}}
theirs = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 16, "hide_emitters": True},
    "sensor": {
        "type": "perspective", "fov": camera["fov"], "fov_axis": "x",
        "to_world": to_world().look_at(origin=camera["origin"], target=camera["target"], up=camera["up"]),
        "film": {"type": "hdrfilm", "width": film["width"], "height": film["height"], "rfilter": {"type": "box"}, "pixel_format": "rgb"},
    },
    "smoke": {
        "type": "cube", "to_world": to_world().translate(list((low + high) / 2)).scale(list((high - low) / 2)), "bsdf": {"type": "null"},
        "interior": {"type": "heterogeneous", "albedo": medium["albedo"],
                     "sigma_t": {"type": "gridvolume", "filename": volume, "to_world": to_world().translate(list(low)).scale(list(high - low))}},
    },
    "light": emitter,
})


class Side:
    def __init__(self, name, spp):
        self.name, self.spp, self.images, self.wall, self.cpu = name, spp, [], [], []

    def add(self, image, wall, cpu):
        self.images.append(np.asarray(image, dtype=np.float64))
        self.wall.append(wall / self.spp)
        self.cpu.append(cpu / self.spp)

    def variance(self):
        return np.stack(self.images).var(axis=0, ddof=1).mean() * self.spp

    def seconds(self, times):
        return self.variance() / 0.01**2 * np.median(times)


def by_mitsuba(side, seed):
    wall, cpu = time.perf_counter(), time.process_time()
    image = np.array(mi.render(theirs, spp=side.spp, seed=seed))
    side.add(image, time.perf_counter() - wall, time.process_time() - cpu)


def by_clume(side, seed):
    with tempfile.NamedTemporaryFile(suffix=".exr") as out:
        said = subprocess.run([clume, "render", path, "-o", out.name, "--spp", str(side.spp), "--seed", str(seed), "--quiet", "--stats-json", "-", "-D", "render.sampler=" + side.name],
                              check=True, capture_output=True, text=True).stdout
        stats = json.loads(said)
        with OpenEXR.File(out.name) as exr:
            side.add(exr.channels()["RGBA" if "RGBA" in exr.channels() else "RGB"].pixels[..., :3], stats["render_s"], stats["cpu_s"])


sides = [Side("volpath", 32), Side("independent", 256), Side("sobol", 256)]
by_mitsuba(Side("warm", sides[0].spp), 999)
for k in range(rounds):
    by_mitsuba(sides[0], k)
    for side in sides[1:]:
        by_clume(side, k)
for s in sides:
    print(f"{s.name:12} mean {np.mean(s.images):.5f}  variance {s.variance():.5f}  s/spp wall {np.median(s.wall):.5f} cpu {np.median(s.cpu):.5f}  "
          f"RMSE 0.01 takes {s.seconds(s.wall):.3f} s wall, {s.seconds(s.cpu):.3f} s of the processor")
for s in sides[1:]:
    print(f"volpath / {s.name}: {sides[0].seconds(sides[0].wall) / s.seconds(s.wall):.1f} by wall clock, {sides[0].seconds(sides[0].cpu) / s.seconds(s.cpu):.1f} by processor time")
