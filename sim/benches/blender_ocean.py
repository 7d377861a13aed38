"""CPU time of a frame of Blender's ocean modifier, to stand beside `cargo bench -p meniscus-sim --bench ocean`.

    python -m pip install bpy        (Python of the version that the wheel names)
    python sim/benches/blender_ocean.py && cargo bench -p meniscus-sim --bench ocean -- elevation_and_displacement_frame

Both make heights and horizontal displacement of one patch. Blender's time includes the evaluation of its modifier, which
is what a user of it pays a frame; its resolution r means r squared samples a side.
"""

import time

import bpy

print("Blender", bpy.app.version_string)
for resolution in (16, 32):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    for mode in ("DISPLACE", "GENERATE"):
        mesh = bpy.data.meshes.new("plane")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
        sea = bpy.data.objects.new("sea", mesh)
        bpy.context.scene.collection.objects.link(sea)
        ocean = sea.modifiers.new("ocean", "OCEAN")
        ocean.geometry_mode = mode
        ocean.resolution = ocean.viewport_resolution = resolution
        ocean.spatial_size = 256
        ocean.wind_velocity = 12.0
        ocean.choppiness = 1.0
        ocean.use_normals = ocean.use_foam = False
        cpu = []
        for k in range(25):
            ocean.time = 1.0 + 0.04 * k
            start = time.process_time()
            _ = sea.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            cpu.append(1e3 * (time.process_time() - start))
        # The first evaluations allocate.
        cpu = sorted(cpu[5:])
        print(f"{resolution**2}² {mode.lower()}: best {cpu[0]:.2f}, median {cpu[len(cpu) // 2]:.2f} CPU ms", flush=True)
        bpy.data.objects.remove(sea)
