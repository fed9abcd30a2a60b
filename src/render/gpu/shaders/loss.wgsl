// The difference of pictures from their targets, summed by each thread over its pixels of a strip of rows, and its gradient
// with respect to the blended colours.
@compute @workgroup_size(64)
fn loss(@builtin(global_invocation_id) id: vec3<u32>) {
    let view = id.z;
    let size = views[view].size;
    let strips = (size.y + STRIP - 1u) / STRIP;
    if id.y >= strips {
        return;
    }
    var sum = 0.0;
    let end = min((id.y + 1u) * STRIP, size.y);
    for (var y = id.y * STRIP; y < end; y++) {
        for (var x = id.x; x < size.x; x += ROW) {
            sum += pixel_loss(view, vec2<u32>(x, y));
        }
    }
    strip_losses[(view * batch.strips + id.y) * ROW + id.x] = sum;
}

fn pixel_loss(view: u32, pixel: vec2<u32>) -> f32 {
    let place = pixel.y * views[view].size.x + pixel.x;
    let at = views[view].pixels + place;
    let wanted = targets[views[view].target_pixels + place];
    let near = is_marked(view, pixel);
    var colour = colours[at].xyz;
    if near {
        colour = blended(view, pixel);
    }
    let difference = colour - wanted.xyz;
    pulled[at] = vec4<f32>(sign(difference) * (wanted.w * batch.scale), select(0.0, 1.0, near));
    let size = abs(difference);
    return (size.x + size.y + size.z) * wanted.w;
}
