// The blended colours, and whether a pixel's centre sees the surface.
@compute @workgroup_size(64)
fn picture(@builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>) {
    let view = group.z;
    let y = group.y;
    let size = views[view].size;
    if id.x >= size.x || y >= size.y {
        return;
    }
    let at = views[view].pixels + y * views[view].stride + id.x;
    blends[at] = vec4<f32>(blended(view, vec2<u32>(id.x, y)), min(colours[at].w, 1.0));
}
