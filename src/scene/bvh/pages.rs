//! Memory in large pages: rays read rows all over it, and then wait less for the translation of
//! addresses.

#[cfg(target_os = "linux")]
use std::mem::MaybeUninit;

use super::layout::Row;

/// Size of a large page, bytes: 2 MB, as on x86-64 and most other processors.
const LARGE_PAGE: usize = 1 << 21;

/// Returns the same rows, moved to large pages if they fill at least one and the system provides
/// large pages on request (Linux).
pub(super) fn in_large_pages(rows: Vec<Row>) -> Vec<Row> {
    if cfg!(not(target_os = "linux")) || size_of_val(&rows[..]) < LARGE_PAGE {
        return rows;
    }
    let mut moved = Vec::with_capacity(rows.len());
    // asked for before the rows are written, because pages already in use stay as they are
    #[cfg(target_os = "linux")]
    ask_for_large_pages(moved.spare_capacity_mut());
    moved.extend(rows);
    moved
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
    fn rows_stay_what_they_are() {
        for count in [0, 1, 65_535, 65_536, 200_000] {
            let rows: Vec<Row> = (0..count).map(|i| Row([i as f32; 8])).collect();
            let moved = in_large_pages(rows.clone());
            assert!(moved.iter().map(|row| row.0).eq(rows.iter().map(|row| row.0)));
        }
    }
}
