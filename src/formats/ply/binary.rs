use super::body::Rows;
use super::header::Scalar;
use crate::formats::stream::Stream;

/// Rows of packed numbers, the most significant byte first where `BIG`.
pub(super) struct BinaryRows<'a, 'b, const BIG: bool> {
    stream: &'a mut Stream<'b>,
}

impl<'a, 'b, const BIG: bool> BinaryRows<'a, 'b, BIG> {
    pub fn new(stream: &'a mut Stream<'b>) -> Self {
        Self { stream }
    }

    /// The next `N` bytes, the least significant first.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut bytes = self.stream.take::<N>().ok_or_else(cut_short)?;
        if BIG {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

#[cold]
fn cut_short() -> String {
    "is cut short: the file ends within it".to_owned()
}

impl<const BIG: bool> Rows for BinaryRows<'_, '_, BIG> {
    fn left(&self) -> u64 {
        self.stream.left()
    }

    fn least(&self, scalar: Scalar) -> usize {
        scalar.size()
    }

    fn start_row(&mut self) -> Result<(), String> {
        Ok(())
    }

    fn number(&mut self, scalar: Scalar) -> Result<f64, String> {
        Ok(match scalar {
            Scalar::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
            // Integers of at most 32 bits: exact.
            _ => self.integer(scalar)? as f64,
        })
    }

    fn any_number(&mut self, scalar: Scalar) -> Result<f64, String> {
        self.number(scalar)
    }

    fn integer(&mut self, scalar: Scalar) -> Result<i64, String> {
        Ok(match scalar {
            Scalar::I8 => i64::from(i8::from_le_bytes(self.take()?)),
            Scalar::U8 => i64::from(u8::from_le_bytes(self.take()?)),
            Scalar::I16 => i64::from(i16::from_le_bytes(self.take()?)),
            Scalar::U16 => i64::from(u16::from_le_bytes(self.take()?)),
            Scalar::I32 => i64::from(i32::from_le_bytes(self.take()?)),
            Scalar::U32 => i64::from(u32::from_le_bytes(self.take()?)),
            Scalar::F32 | Scalar::F64 => return Err("holds a number that is no integer type".to_owned()),
        })
    }

    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), String> {
        let bytes = count.checked_mul(scalar.size() as u64);
        if bytes.is_some_and(|bytes| self.stream.skip(bytes)) { Ok(()) } else { Err(cut_short()) }
    }

    fn end_row(&mut self) -> Result<(), String> {
        Ok(())
    }

    fn place(&self) -> String {
        String::new()
    }
}
