//! Binary encoding of numbers and lists, little-endian. Memory grows with the available bytes, not
//! with a count that is read.

use crate::Vec3;

/// Reads bytes from the front; returns `None` if they end early or are invalid.
pub(crate) struct Reader<'a>(pub &'a [u8]);

impl Reader<'_> {
    pub fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    pub fn size(&mut self) -> Option<usize> {
        usize::try_from(u64::from_le_bytes(self.take()?)).ok()
    }

    pub fn flag(&mut self) -> Option<bool> {
        match self.take()? {
            [0] => Some(false),
            [1] => Some(true),
            _ => None,
        }
    }

    /// Reads a finite number.
    pub fn number(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes).filter(|x| x.is_finite())
    }

    /// Reads a finite number in single precision.
    pub fn single(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes).filter(|x| x.is_finite())
    }

    pub fn vector(&mut self) -> Option<Vec3> {
        Some(Vec3::new(self.number()?, self.number()?, self.number()?))
    }

    /// Reads a list of items of at least one byte each.
    pub fn list<T>(&mut self, mut item: impl FnMut(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        let count = self.size().filter(|count| *count <= self.0.len())?;
        let mut items = Vec::new();
        for _ in 0..count {
            items.push(item(self)?);
        }
        Some(items)
    }
}

/// Writes the data that [`Reader`] reads.
pub(crate) trait Write {
    fn u32(&mut self, x: u32);
    fn size(&mut self, n: usize);
    fn flag(&mut self, flag: bool);
    fn number(&mut self, x: f64);
    fn single(&mut self, x: f32);
    fn vector(&mut self, v: &Vec3);
    fn list<T>(&mut self, items: &[T], item: impl FnMut(&mut Self, &T));
}

impl Write for Vec<u8> {
    fn u32(&mut self, x: u32) {
        self.extend(x.to_le_bytes());
    }

    fn size(&mut self, n: usize) {
        self.extend((n as u64).to_le_bytes());
    }

    fn flag(&mut self, flag: bool) {
        self.push(u8::from(flag));
    }

    fn number(&mut self, x: f64) {
        self.extend(x.to_le_bytes());
    }

    fn single(&mut self, x: f32) {
        self.extend(x.to_le_bytes());
    }

    fn vector(&mut self, v: &Vec3) {
        v.iter().for_each(|x| self.number(*x));
    }

    fn list<T>(&mut self, items: &[T], mut item: impl FnMut(&mut Self, &T)) {
        self.size(items.len());
        items.iter().for_each(|one| item(self, one));
    }
}
