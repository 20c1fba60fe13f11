//! The same increments twice, once with rejected trials in between: the committed state is the same.
//!
//! Naive codes let histories of rejected trials leak into the next one. Here a trial with twenty times the
//! step is made and thrown away before each increment (`verification::penalties`).

use riprap::verification::penalties::{difference, pushed};

#[test]
fn rejected_trials_leave_the_committed_state_alone() {
    let ((plain, fewer), (tried, _)) = (pushed(false), pushed(true));
    assert!(fewer > 0);
    let apart = difference(&plain, &tried);
    assert!(apart < 1e-12, "{apart}");
    assert!(plain.memory.values().all(|pair| pair.slip > 50e-6), "slipped beyond the weakening distance");
}
