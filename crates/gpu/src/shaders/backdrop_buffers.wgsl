// Two vec4 a disk: unit direction and angular radius; radiance.
@group(0) @binding(2) var<storage, read> gpu_disks: array<vec4<f32>>;

fn gpu_disk_row(i: u32) -> vec4<f32> {
    return gpu_disks[i];
}
