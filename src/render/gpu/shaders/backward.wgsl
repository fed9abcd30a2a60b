// What the pixels of each triangle in each group of views ask of its corners: 3 by (position, normal, albedo where there is
// any).
@compute @workgroup_size(64)
fn backward(@builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>) {
    let triangle = id.x;
    if triangle >= batch.triangles {
        return;
    }
    let ends = vec3<u32>(triangles[3u * triangle], triangles[3u * triangle + 1u], triangles[3u * triangle + 2u]);
    let n0 = normals[ends.x].xyz;
    let n1 = normals[ends.y].xyz;
    let n2 = normals[ends.z].xyz;
    var r0 = vec3<f32>(1.0);
    var r1 = r0;
    var r2 = r0;
    if batch.with_albedo != 0u {
        r0 = albedo[ends.x].xyz;
        r1 = albedo[ends.y].xyz;
        r2 = albedo[ends.z].xyz;
    }
    var position0 = vec3<f32>(0.0);
    var position1 = position0;
    var position2 = position0;
    var normal0 = position0;
    var normal1 = position0;
    var normal2 = position0;
    var albedo0 = position0;
    var albedo1 = position0;
    var albedo2 = position0;
    let views_end = min((group.y + 1u) * GROUP, batch.views);
    for (var view = group.y * GROUP; view < views_end; view++) {
        let c0 = corner(view, ends.x);
        let c1 = corner(view, ends.y);
        let c2 = corner(view, ends.z);
        let p0 = pixel_of(c0);
        let p1 = pixel_of(c1);
        let p2 = pixel_of(c2);
        let area = cross2(p1 - p0, p2 - p0);
        let stays = min(min(c0.w, c1.w), c2.w) > 0.0 && !(batch.closed != 0u && area > 0.0);
        let size = views[view].size;
        // Corners are rounded before they are drawn, by less than a 128th.
        let low = max(ceil(min(p0, min(p1, p2)) - (0.5 + 0.0078125)), vec2<f32>(0.0));
        let high = min(floor(max(p0, max(p1, p2)) - (0.5 - 0.0078125)), vec2<f32>(size) - 1.0);
        if !stays || any(low > high) {
            continue;
        }
        let is_wide = abs(area) >= LEAST_AREA;
        let light = views[view].light;
        let start = views[view].pixels;
        let stride = views[view].stride;
        let h0 = seen_from(c0, low);
        let h1 = seen_from(c1, low);
        let h2 = seen_from(c2, low);
        let plane0 = cross(h1, h2);
        let plane1 = cross(h2, h0);
        let plane2 = cross(h0, h1);
        var moment0 = vec3<f32>(0.0);
        var moment1 = moment0;
        var moment2 = moment0;
        let seen = f32(triangle + 1u);
        let first = vec2<u32>(low);
        let last = vec2<u32>(high);
        for (var y = first.y; y <= last.y; y++) {
            let row = start + y * stride;
            for (var x = first.x; x <= last.x; x++) {
                if colours[row + x].w != seen {
                    continue;
                }
                let packed = pulled[row + x];
                var pull = pull_of(view, packed);
                if (packed & CHANGED) != 0u {
                    pull = changed[row + x].xyz;
                }
                let spot = vec3<f32>(f32(x) - low.x, f32(y) - low.y, 1.0);
                let a = vec3<f32>(dot(plane0, spot), dot(plane1, spot), dot(plane2, spot));
                let inverse_sum = inverse_of(a.x + a.y + a.z);
                let weights = weights_of(a, inverse_sum);
                let mean = n0 * weights.x + n1 * weights.y + n2 * weights.z;
                let inverse_length = 1.0 / max(length(mean), LEAST_NORMAL);
                let n = mean * inverse_length;
                var lit = pull;
                var by_weight = vec3<f32>(0.0);
                if batch.with_albedo != 0u {
                    let of_albedo = pull * light_colour(light, n);
                    albedo0 += of_albedo * weights.x;
                    albedo1 += of_albedo * weights.y;
                    albedo2 += of_albedo * weights.z;
                    by_weight = vec3<f32>(dot(of_albedo, r0), dot(of_albedo, r1), dot(of_albedo, r2));
                    lit *= r0 * weights.x + r1 * weights.y + r2 * weights.z;
                }
                let of_unit = light_gradient(light, n, lit);
                let of_normal = (of_unit - n * dot(n, of_unit)) * inverse_length;
                normal0 += of_normal * weights.x;
                normal1 += of_normal * weights.y;
                normal2 += of_normal * weights.z;
                by_weight += vec3<f32>(dot(of_normal, n0), dot(of_normal, n1), dot(of_normal, n2));
                let of_a = (by_weight - dot(by_weight, weights)) * select(0.0, inverse_sum, is_wide);
                moment0 += spot * of_a.x;
                moment1 += spot * of_a.y;
                moment2 += spot * of_a.z;
            }
        }
        position0 += position_gradient(view, low, cross(moment1, h2) + cross(h1, moment2));
        position1 += position_gradient(view, low, cross(moment2, h0) + cross(h2, moment0));
        position2 += position_gradient(view, low, cross(moment0, h1) + cross(h0, moment1));
    }
    let width = select(6u, 9u, batch.with_albedo != 0u);
    let at = 3u * width * (group.y * batch.triangles + triangle);
    put(at, position0);
    put(at + 3u, normal0);
    put(at + width, position1);
    put(at + width + 3u, normal1);
    put(at + 2u * width, position2);
    put(at + 2u * width + 3u, normal2);
    if batch.with_albedo != 0u {
        put(at + 6u, albedo0);
        put(at + 15u, albedo1);
        put(at + 24u, albedo2);
    }
}

fn put(at: u32, value: vec3<f32>) {
    triangle_gradients[at] = value.x;
    triangle_gradients[at + 1u] = value.y;
    triangle_gradients[at + 2u] = value.z;
}

// From the gradient with respect to (u w, v w, w) as seen from a pixel.
fn position_gradient(view: u32, pixel: vec2<f32>, h: vec3<f32>) -> vec3<f32> {
    return views[view].rows[0].xyz * h.x + views[view].rows[1].xyz * h.y
        + views[view].rows[2].xyz * (h.z - dot(pixel + 0.5, h.xy));
}

fn light_gradient(light: array<vec4<f32>, 9>, n: vec3<f32>, lit: vec3<f32>) -> vec3<f32> {
    let xy = dot(light[4].xyz, lit);
    let yz = dot(light[5].xyz, lit);
    let zz = 6.0 * dot(light[6].xyz, lit);
    let xz = dot(light[7].xyz, lit);
    let xx = 2.0 * dot(light[8].xyz, lit);
    return vec3<f32>(
        dot(light[1].xyz, lit) + xy * n.y + xz * n.z + xx * n.x,
        dot(light[2].xyz, lit) + xy * n.x + yz * n.z - xx * n.y,
        dot(light[3].xyz, lit) + yz * n.y + xz * n.x + zz * n.z,
    );
}
