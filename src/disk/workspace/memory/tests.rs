use super::*;

#[test]
fn refuses_with_the_number_that_would_do() {
    let pool = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    let held = pool.reserve("held", 1 << 20).unwrap();
    let error = pool.reserve("big", pool.capacity()).unwrap_err();
    match &error {
        Error::Memory { needed, .. } => assert_eq!(*needed, MINIMUM_BUDGET + (1 << 20)),
        other => panic!("{other}"),
    }
    assert!(error.to_string().contains("held: 1048576"), "{error}");
    drop(held);
    let all = pool.reserve("big", pool.capacity()).unwrap();
    assert_eq!(pool.available(), 0);
    drop(all);
    assert_eq!(pool.available(), pool.capacity());
}

/// Found by fuzzing: the sum was taken modulo 2^64, so this reservation was granted.
#[test]
fn refuses_what_has_no_sum_with_what_is_held() {
    let pool = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    let _held = pool.reserve("held", 4096).unwrap();
    for bytes in [u64::MAX, u64::MAX - 100, u64::MAX - 4095] {
        let error = pool.reserve("huge", bytes).unwrap_err();
        assert!(
            matches!(
                error,
                Error::Memory {
                    needed: u64::MAX,
                    ..
                }
            ),
            "{error}"
        );
        assert!(pool.promise_waiting("huge", bytes).is_err());
    }
    assert_eq!(pool.peak(), PROGRAM + 4096);
}

#[test]
fn what_is_held_is_what_was_said() {
    let pool = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    let mut promised = pool.promise("promised", 5 << 20).unwrap();
    assert_eq!(pool.peak_held(), PROGRAM);
    promised.set_held(3 << 20);
    promised.set_held(1 << 20);
    let whole = pool.reserve("whole", 1 << 20).unwrap();
    assert_eq!(pool.peak_held(), PROGRAM + (3 << 20));
    assert_eq!(pool.held_at_peak()["promised"], 3 << 20);
    assert_eq!(pool.peak(), PROGRAM + (6 << 20));
    promised.give_back(4 << 20);
    assert_eq!(pool.available(), pool.capacity() - (2 << 20));
    // It counts as a holder until it is dropped.
    promised.give_back(u64::MAX);
    assert_eq!(promised.bytes(), 1);
    // It grows as far as the budget allows.
    promised.at_least(2 << 20).unwrap();
    promised.at_least(1 << 20).unwrap();
    assert_eq!(promised.bytes(), 2 << 20);
    assert!(promised.at_least(pool.capacity()).is_err());
    assert_eq!(pool.available(), pool.capacity() - (3 << 20));
    drop((promised, whole));
    assert_eq!(pool.available(), pool.capacity());
    assert_eq!(pool.take_held(), PROGRAM + (3 << 20));
    assert_eq!(pool.take_held(), PROGRAM);
}

#[test]
fn where_memory_is_tight_what_is_held_now_counts() {
    let pool = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    if !pool.is_tight() {
        return;
    }
    let mut slot = Slot::new(&pool, "unit");
    let at_work = Usage::of(pool.promise_waiting("unit", 8 << 20).unwrap());
    let first = at_work.hold(3 << 20);
    drop(at_work.hold(2 << 20));
    let _ = pool.take_held();
    assert_eq!(pool.take_held(), PROGRAM + (3 << 20));
    let second = at_work.hold(4 << 20);
    drop((first, second));
    assert_eq!(pool.peak_held(), PROGRAM + (7 << 20));
    slot.ended(at_work);
    let _ = pool.take_held();
    assert_eq!(pool.take_held(), PROGRAM + TIGHT_THREAD);
    // A unit that reports no usage counts with its whole reservation.
    let silent = Usage::of(pool.promise_waiting("unit", 9 << 20).unwrap());
    slot.ended(silent);
    assert_eq!(pool.peak_held(), PROGRAM + TIGHT_THREAD + (9 << 20));
    assert_eq!(pool.available(), pool.capacity());
}

#[test]
fn a_thread_counts_for_its_largest_unit() {
    let pool = MemoryPool::new(TIGHT).unwrap();
    let mut slot = Slot::new(&pool, "unit");
    for bytes in [3 << 20, 5 << 20, 2 << 20] {
        let at_work = Usage::of(pool.promise_waiting("unit", 8 << 20).unwrap());
        let first = at_work.hold(bytes / 2);
        let second = at_work.hold(bytes / 2);
        drop(first);
        at_work.give_back(1 << 20);
        assert_eq!(pool.available(), pool.capacity() - (7 << 20));
        drop((second, at_work.hold(7)));
        slot.ended(at_work);
    }
    assert_eq!(pool.held_at_peak()["unit"], 5 << 20);
    assert_eq!(pool.peak_held(), PROGRAM + THREAD + (5 << 20));
    drop(slot);
    assert_eq!(pool.available(), pool.capacity());
}

#[test]
fn refuses_a_budget_below_the_minimum() {
    assert!(matches!(
        MemoryPool::new(1 << 20),
        Err(Error::Memory { .. })
    ));
}

#[test]
fn waits_for_its_own_kind() {
    let pool = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    let most = pool.capacity() * 2 / 3;
    let peak = std::thread::scope(|scope| {
        for _ in 0..4 {
            let pool = pool.clone();
            scope.spawn(move || drop(pool.promise_waiting("unit", most).unwrap()));
        }
        pool.peak()
    });
    assert!(peak <= pool.capacity());
    assert_eq!(pool.available(), pool.capacity());
}
