//! Typed indices and the tables that they address.

use hyd_index::{IndexVec, typed_index};

typed_index!(RowId, "row");

#[test]
fn indices_print_with_their_prefix_and_address_their_table() {
    let mut table: IndexVec<RowId, &str> = IndexVec::new();
    let first = table.push("a");
    let second = table.push("b");
    assert_eq!((first.to_string(), table[second]), ("row0".to_string(), "b"));
    assert_eq!(table.indices().collect::<Vec<_>>(), vec![first, second]);
}
