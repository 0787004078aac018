//! Numbers that decide what of a bus is believed or refused.

crate::thresholds! {
    /// load over which a bus is warned about: what is left carries retransmissions and other nodes
    warning_percent: f64 = 70.0, "%", "common practice for CAN";
    /// load over which a bus is refused
    maximum_percent: f64 = 100.0, "%", "capacity of the bus";
    /// frames in a row that may be missing between two good values of a counter; more is a jump
    maximum_lost: u64 = 3, "count", "judgement";
    /// how long the number of a transfer is remembered: within it one with the same number is the same one, sent twice
    transfer_id_kept_ns: u64 = 2_000_000_000, "ns", "DroneCAN specification";
    /// time between two frames of a transfer, beyond which it is given up
    transfer_under_way_ns: u64 = 1_000_000_000, "ns", "DroneCAN's reference implementation";
    /// time for which a node may be silent: beyond, the bench does without it
    node_silent_ns: u64 = 3_000_000_000, "ns", "DroneCAN specification (OFFLINE_TIMEOUT_MS)";
    /// time between two restarts of a node: within it two nodes are taken to have one id, as their uptimes alternate
    node_restart_apart_ns: u64 = 5_000_000_000, "ns", "judgement";
    /// time between two parts of a unique id, beyond which a node that asks for a node id begins anew
    allocation_part_ns: u64 = 500_000_000, "ns", "DroneCAN specification (FOLLOWUP_TIMEOUT_MS)";
    /// time for which a bench waits for a node id before it gives up: some ten requests
    allocation_patience_ns: u64 = 10_000_000_000, "ns", "judgement";
    /// least time between two first requests for a node id
    request_ns: u64 = 600_000_000, "ns", "DroneCAN specification (MIN_REQUEST_PERIOD_MS)";
    /// most that is drawn by lot beside `request_ns`, so that two nodes do not ask at once
    request_drawn_ns: u64 = 400_000_000, "ns", "DroneCAN specification (MAX_REQUEST_PERIOD_MS less the least)";
    /// most that is drawn by lot before the next part of a unique id is said
    follow_up_drawn_ns: u64 = 400_000_000, "ns", "DroneCAN specification (MAX_FOLLOWUP_DELAY_MS)";
    /// time from look to look at what came, while a node id is waited for
    allocation_look_ns: u64 = 2_000_000, "ns", "judgement: a frame in a queue waits no longer";
    /// time after which a node that did not answer is asked again
    ask_again_ns: u64 = 500_000_000, "ns", "judgement: half of the specification's time-out of a service";
    /// times that one question is asked of a node
    most_asked: u32 = 4, "count", "judgement: 2 s in all";
    /// time for which an emulated ESC believes that it is armed without hearing it again
    armed_for_ns: u64 = 2_000_000_000, "ns", "judgement: the guard says it twice a second, and two in a row may be lost";
    /// time from look to look for an interface that is gone
    interface_look_ns: u64 = 50_000_000, "ns", "judgement: nobody plugs an adapter in faster";
    /// most that an adapter's clock and the machine's run apart, as a share of the time
    adapter_drift: f64 = 200e-6, "-", "crystals of 100 ppm on both sides";
    /// time off, beyond which an adapter's clock has been set anew rather than drifted
    adapter_jump_ns: u64 = 1_000_000_000, "ns", "judgement";
    /// age at which the distance of the two clocks must be measured again; from half of it on it may be
    distance_oldest_ns: u64 = 100_000_000, "ns", "judgement";
    /// drift of two clocks in each `distance_oldest_ns`: 500 ppm, the most that Linux disciplines CLOCK_REALTIME with
    distance_drift_ns: u64 = 50_000, "ns", "adjtimex(2)";
    /// most readings of the two clocks, of which the narrowest counts: the others were interrupted
    clock_readings: usize = 3, "count", "judgement";
    /// time that a given time may be too early without the clock being asked: what publishing takes on a slow machine. By more,
    /// CLOCK_REALTIME may have been set
    early_ns: u64 = 200_000, "ns", "judgement";
}
