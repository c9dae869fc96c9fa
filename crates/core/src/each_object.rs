//! Loops over the objects of a world, on several threads.

use crate::derived::Cache;
use crate::object::part_state::PartState;
use crate::threads::Threads;
use crate::world::view::{Entry, Objects};
use std::ops::Range;

/// Minimum number of objects of a piece, about 10 µs.
const OBJECTS: usize = 64;

/// Arrays that a loop changes, with the numbers of all objects. An array that it does not change is
/// left empty.
#[derive(Default)]
pub(crate) struct Numbers<'a> {
    pub caches: &'a mut [Cache],
    pub x: &'a mut [f64],
    /// One number per degree of freedom.
    pub v: &'a mut [f64],
    /// Another one per degree of freedom.
    pub w: &'a mut [f64],
    pub part_states: &'a mut [PartState],
}

/// The numbers of one object.
pub(crate) struct Own<'a> {
    pub cache: &'a mut Cache,
    pub x: &'a mut [f64],
    pub v: &'a mut [f64],
    pub w: &'a mut [f64],
    pub part_states: &'a mut [PartState],
}

/// Calls `work` for every object that a step walks with its numbers. The objects may be on several threads at once.
pub(crate) fn each_object(threads: &Threads, objects: Objects, numbers: Numbers, work: impl Fn(&Entry, Own) + Sync) {
    let Numbers { caches, x, v, w, part_states } = numbers;
    let mut rest = Slices {
        caches: Slice { start: 0, numbers: caches },
        x: Slice { start: 0, numbers: x },
        v: Slice { start: 0, numbers: v },
        w: Slice { start: 0, numbers: w },
        part_states: Slice { start: 0, numbers: part_states },
    };
    let walked = &objects.table.walk.places;
    let count = walked.len();
    if threads.count() == 1 || count < 2 * OBJECTS {
        return rest.walk(objects, walked, &work);
    }
    let places = threads.pieces(count, OBJECTS);
    let pieces: Vec<(&[u32], Slices)> = places
        .into_iter()
        .map(|places| {
            let last = walked[places.end - 1] as usize;
            let ends = &objects.table.placed[last].state_range;
            let piece = Slices {
                caches: rest.caches.take(last + 1),
                x: rest.x.take(ends.x.end),
                v: rest.v.take(ends.v.end),
                w: rest.w.take(ends.v.end),
                part_states: rest.part_states.take(ends.parts.end),
            };
            (&walked[places], piece)
        })
        .collect();
    threads.each(pieces, |(places, mut slices)| slices.walk(objects, places, &work));
}

/// Returns the first walked object, in the order of adding, of which `is` is true.
pub(crate) fn first_object<'a>(
    threads: &Threads,
    objects: Objects<'a>,
    is: impl Fn(&Entry) -> bool + Sync,
) -> Option<Entry<'a>> {
    let walked = &objects.table.walk.places;
    if threads.count() == 1 || walked.len() < 2 * OBJECTS {
        return walked.iter().map(|&place| objects.at(place as usize)).find(|entry| is(entry));
    }
    let mut found: Vec<(Range<usize>, Option<usize>)> =
        threads.pieces(walked.len(), OBJECTS).into_iter().map(|places| (places, None)).collect();
    threads.each(&mut found[..], |(places, found)| {
        *found = walked[places.clone()].iter().map(|&place| place as usize).find(|place| is(&objects.at(*place)));
    });
    found.into_iter().find_map(|(_, place)| place).map(|place| objects.at(place))
}

/// The numbers of walked objects, ascending.
struct Slices<'a> {
    caches: Slice<'a, Cache>,
    x: Slice<'a, f64>,
    v: Slice<'a, f64>,
    w: Slice<'a, f64>,
    part_states: Slice<'a, PartState>,
}

impl Slices<'_> {
    fn walk(&mut self, objects: Objects, places: &[u32], work: impl Fn(&Entry, Own)) {
        for place in places.iter().map(|&place| place as usize) {
            let entry = objects.at(place);
            let range = entry.state_range;
            let own = Own {
                cache: &mut self.caches.numbers[place - self.caches.start],
                x: self.x.of(&range.x),
                v: self.v.of(&range.v),
                w: self.w.of(&range.v),
                part_states: self.part_states.of(&range.parts),
            };
            work(&entry, own);
        }
    }
}

/// Part of an array from `start` on.
struct Slice<'a, T> {
    start: usize,
    numbers: &'a mut [T],
}

impl<'a, T> Slice<'a, T> {
    /// Splits off everything before the index `end` of the whole array.
    fn take(&mut self, end: usize) -> Slice<'a, T> {
        let (start, all) = (self.start, std::mem::take(&mut self.numbers));
        let (numbers, rest) = all.split_at_mut(end.saturating_sub(start).min(all.len()));
        (self.start, self.numbers) = (end.max(start), rest);
        Slice { start, numbers }
    }

    /// Returns a range of the whole array; nothing if the array is empty.
    fn of(&mut self, range: &Range<usize>) -> &mut [T] {
        if self.numbers.is_empty() {
            &mut []
        } else {
            &mut self.numbers[range.start - self.start..range.end - self.start]
        }
    }
}
