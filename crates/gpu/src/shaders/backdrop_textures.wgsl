// Two texels a disk: unit direction and angular radius; radiance.
@group(0) @binding(2) var gpu_disks: texture_2d<f32>;

fn gpu_disk_row(i: u32) -> vec4<f32> {
    return textureLoad(gpu_disks, vec2<u32>(i, 0u), 0);
}
