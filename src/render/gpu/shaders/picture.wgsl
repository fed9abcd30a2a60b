// The blended colours, and whether a pixel's centre sees the surface.
@compute @workgroup_size(64)
fn picture(@builtin(global_invocation_id) id: vec3<u32>) {
    let view = id.z;
    let size = views[view].size;
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let seen = ids[views[view].ids + id.y * views[view].stride + id.x];
    let at = views[view].pixels + id.y * size.x + id.x;
    pulled[at] = vec4<f32>(blended(view, id.xy), select(1.0, 0.0, seen == 0u));
}
