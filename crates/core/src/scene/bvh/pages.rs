//! Memory in large pages: rays read rows all over it, and then wait less for the translation of
//! addresses.

#[cfg(target_os = "linux")]
use std::mem::MaybeUninit;

use super::layout::Row;

/// Size of a large page, bytes: 2 MB, as on x86-64 and most other processors.
#[cfg(target_os = "linux")]
const LARGE_PAGE: usize = 1 << 21;

/// Returns room for so many rows, in large pages if they fill at least one and the system provides
/// large pages on request (Linux).
pub(super) fn room_for(rows: usize) -> Vec<Row> {
    let mut room = Vec::with_capacity(rows);
    // asked for before the rows are written, because pages already in use stay as they are
    #[cfg(target_os = "linux")]
    if rows * size_of::<Row>() >= LARGE_PAGE {
        ask_for_large_pages(room.spare_capacity_mut());
    }
    room
}

#[cfg(target_os = "linux")]
fn ask_for_large_pages(memory: &mut [MaybeUninit<Row>]) {
    let start = memory.as_mut_ptr().cast::<u8>();
    let before = start.align_offset(LARGE_PAGE);
    let whole = size_of_val(memory).saturating_sub(before) / LARGE_PAGE * LARGE_PAGE;
    #[allow(unsafe_code)]
    // SAFETY: these are whole pages of a slice that this function owns; the advice moves no byte,
    // and may be ignored.
    unsafe {
        libc::madvise(start.wrapping_add(before).cast(), whole, libc::MADV_HUGEPAGE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_empty_and_suffices() {
        for count in [0, 1, 65_535, 65_536, 200_000] {
            let mut rows = room_for(count);
            assert!(rows.is_empty() && rows.capacity() >= count);
            rows.extend((0..count).map(|i| Row([i as f32; 8])));
            assert!(rows.iter().enumerate().all(|(i, row)| row.0 == [i as f32; 8]));
        }
    }
}
