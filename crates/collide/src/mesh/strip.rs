//! Triangle strips: each vertex after the first two makes a triangle with the two before it.
//!
//! Triangle `k` of a strip is `(v_k, v_k+1, v_k+2)` for even `k` and `(v_k+1, v_k, v_k+2)` for odd
//! `k`, so all have the same winding. `-1` ends a strip; the next one starts with an even triangle.
//! A triangle that repeats a vertex only moves the strip and is skipped.

/// Ends a strip.
const RESTART: i64 = -1;

/// Returns the triangles of the strips in `indices`, which are indices of `count` vertices from 0.
pub(super) fn strip_triangles(indices: &[i64], count: usize) -> Result<Vec<[u32; 3]>, String> {
    let mut triangles = Vec::with_capacity(indices.len().saturating_sub(2));
    for strip in indices.split(|&index| index == RESTART) {
        // consecutive or trailing restarts make empty strips
        if !strip.is_empty() && strip.len() < 3 {
            return Err(format!("a strip of {} vertices, but it needs at least 3", strip.len()));
        }
        let strip: Vec<u32> = strip.iter().map(|&index| check_index(index, count)).collect::<Result<_, _>>()?;
        let turned = |(k, v): (usize, &[u32])| if k % 2 == 0 { [v[0], v[1], v[2]] } else { [v[1], v[0], v[2]] };
        let proper = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        triangles.extend(strip.windows(3).enumerate().map(turned).filter(proper));
    }
    Ok(triangles)
}

fn check_index(index: i64, count: usize) -> Result<u32, String> {
    let within = u32::try_from(index).ok().filter(|&v| (v as usize) < count);
    within
        .ok_or_else(|| format!("it refers to vertex {index} (from 0), but there are {count} vertices; -1 ends a strip"))
}
