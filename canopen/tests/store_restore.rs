//! Storing and restoring parameters (CiA 301 v4.2, sections 7.5.2.13, 7.5.2.14 and 7.5.2.23 to 7.5.2.25).

mod bench;

use bench::Bench;
use canopen::{Event, Order};
use od::{AbortCode, Access, Address, DataType, Entry, Group, Object, Saved, Value};

/// 0x1010 and 0x1011 with three groups and a fourth one that cannot be stored, 0x1020, 0x1021, 0x1022.
fn objects() -> Vec<Object> {
    let number = |sub, value| {
        Entry { is_volatile: true, ..Entry::new(sub, "Group", DataType::Unsigned32, Access::ReadWrite) }
            .with_value(Value::Fixed(value))
    };
    let groups = || vec![number(1, 1), number(2, 1), number(3, 1), number(4, 0)];
    let word = |sub| Entry::new(sub, "Date or time", DataType::Unsigned32, Access::ReadWrite);
    let sheet = Entry::new(0, "Store EDS", DataType::Domain, Access::ReadOnly)
        .with_value(Value::bytes(b"[FileInfo]\nFileName=bench.eds\n"));
    vec![
        Object::array(0x1010, "Store parameters", groups()),
        Object::array(0x1011, "Restore default parameters", groups()),
        Object::array(0x1020, "Verify configuration", vec![word(1), word(2)]),
        Object::var(0x1021, sheet),
        Object::var(0x1022, Entry::new(0, "Store format", DataType::Unsigned8, Access::ReadOnly)),
    ]
}

/// The bench and what its owner has in store.
struct Owner {
    bench: Bench,
    stored: (Saved, Saved),
}

impl Owner {
    fn new() -> Self {
        let mut bench = Bench::off_with(objects());
        bench.node.start(bench.now, &bench.device);
        bench.settle();
        bench.events();
        Self { bench, stored: (Saved::default(), Saved::default()) }
    }

    fn talk(&mut self, script: &str) {
        self.bench.talk(script);
    }

    /// The order that the node has passed on, if any. The device is reset where the node says so.
    fn order(&mut self) -> Option<Order> {
        let mut order = None;
        for event in self.bench.events() {
            match event {
                Event::Storage(wanted) => order = Some(wanted),
                Event::Reset => self.bench.device.reset(),
                Event::Nmt(_)
                | Event::NodeId(_)
                | Event::Subscriptions
                | Event::Time
                | Event::QueueOverflow
                | Event::QueueDrained
                | Event::ConnectionLost(_)
                | Event::Emergency { .. } => {}
            }
        }
        order
    }

    /// Does what the node wants.
    fn obey(&mut self) {
        let order = self.order().expect("an order");
        self.stored = (order.apply(self.bench.node.communication()), order.apply(&self.bench.device));
        self.load();
        self.bench.node.stored(self.bench.now, Ok(()));
    }

    /// Hands over what is in store.
    fn load(&mut self) {
        let (communication, application) = self.stored.clone();
        assert_eq!(self.bench.node.set_saved(communication), 0);
        assert_eq!(self.bench.device.set_saved(application), 0);
    }

    /// Power off and on.
    fn cut_power(&mut self) {
        let stored = core::mem::take(&mut self.stored);
        *self = Self { stored, bench: Bench::off_with(objects()) };
        self.load();
        self.bench.device.reset();
        self.bench.node.start(self.bench.now, &self.bench.device);
        self.bench.settle();
        self.bench.events();
    }

    /// Sends an SDO and expects it to be good.
    fn write(&mut self, address: &str, size: u8, value: u32) {
        let (index, sub) = address.split_once(':').unwrap();
        let [low, high] = u16::from_str_radix(index, 16).unwrap().to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let command = 0x23 | (4 - size) << 2;
        self.talk(&format!(
            "> 601#{command:02X}{low:02X}{high:02X}{sub}{a:02X}{b:02X}{c:02X}{d:02X}
             < 581#60{low:02X}{high:02X}{sub}00000000"
        ));
    }

    fn save(&mut self, sub: u8) {
        assert!(self.bench.send(&format!("601#231010{sub:02X}73617665")).is_empty(), "not yet");
        self.obey();
        self.talk(&format!("< 581#601010{sub:02X}00000000"));
    }

    fn restore(&mut self, sub: u8) {
        assert!(self.bench.send(&format!("601#231110{sub:02X}6C6F6164")).is_empty(), "not yet");
        self.obey();
        self.talk(&format!("< 581#601110{sub:02X}00000000"));
    }

    /// A reset of the node or of the communication alone.
    fn reset(&mut self, command: &str) {
        let sent = self.bench.send(command);
        assert_eq!(sent[0].to_string(), "701#00");
        assert_eq!(self.order(), None);
    }

    fn heartbeat(&mut self) -> u32 {
        self.read(0x1017, 0)
    }

    fn read(&mut self, index: u16, sub: u8) -> u32 {
        let bytes = self.bench.upload(Address::new(index, sub)).unwrap();
        bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
    }
}

const RESET_NODE: &str = "000#8101";
const RESET_COMMUNICATION: &str = "000#8201";

#[test]
fn reading_says_that_parameters_are_stored_on_command() {
    Owner::new().talk(
        "
        > 601#4010100000000000
        < 581#4F10100004000000
        > 601#4010100100000000
        < 581#4310100101000000
        > 601#4011100100000000
        < 581#4311100101000000
        > 601#4010100400000000
        < 581#4310100400000000 // this group cannot be stored
        ",
    );
}

// CCT 8.1-8.4, 8.7, 8.8
#[test]
fn a_wrong_signature_is_refused_08000020_and_changes_nothing() {
    let mut owner = Owner::new();
    owner.write("1017:00", 2, 1000);
    owner.talk(
        "
        > 601#2310100177726F6E // wron
        < 581#8010100120000008
        > 601#2310100165766173 // evas
        < 581#8010100120000008
        > 601#231010016C6F6164 // load
        < 581#8010100120000008
        > 601#2310100153415645 // SAVE
        < 581#8010100120000008
        > 601#2311100177726F6E // wron
        < 581#8011100120000008
        > 601#2311100164616F6C // daol
        < 581#8011100120000008
        > 601#2311100277726F6E
        < 581#8011100220000008
        > 601#2311100173617665 // save
        < 581#8011100120000008
        > 601#2B10100173610000 // too short
        < 581#8010100113000706
        > 601#2310100473617665 // a group that cannot be stored
        < 581#8010100420000008
        > 601#2310100573617665 // a group that does not exist
        < 581#8010100511000906
        > 601#4010100100000000
        < 581#4310100101000000
        ",
    );
    assert_eq!(owner.order(), None);
    assert_eq!(owner.heartbeat(), 1000);
}

// CCT 8.5, 8.6
#[test]
fn saved_parameters_come_back_after_every_reset_and_power_cut() {
    let mut owner = Owner::new();
    owner.write("1017:00", 2, 1000);
    owner.write("2107:00", 2, 7);
    owner.write("6200:01", 1, 9);
    owner.save(1);
    owner.write("1017:00", 2, 0);
    owner.write("2107:00", 2, 0);
    owner.write("6200:01", 1, 0);

    owner.reset(RESET_COMMUNICATION);
    assert_eq!(owner.heartbeat(), 1000);
    assert_eq!(owner.read(0x2107, 0), 0, "the application goes on");
    owner.reset(RESET_NODE);
    assert_eq!((owner.read(0x2107, 0), owner.read(0x6200, 1)), (7, 9));
    owner.cut_power();
    assert_eq!((owner.heartbeat(), owner.read(0x2107, 0), owner.read(0x6200, 1)), (1000, 7, 9));
    owner.talk("+ 1s\n< 701#7F // and act");
}

#[test]
fn what_was_not_saved_is_gone_after_a_reset() {
    let mut owner = Owner::new();
    owner.write("1017:00", 2, 1000);
    owner.save(1);
    owner.write("1017:00", 2, 2000);
    owner.reset(RESET_NODE);
    assert_eq!(owner.heartbeat(), 1000);
}

#[test]
fn groups_are_saved_apart() {
    let mut owner = Owner::new();
    owner.write("1017:00", 2, 1000);
    owner.write("2107:00", 2, 7);
    owner.write("6200:01", 1, 9);
    owner.save(2);
    owner.cut_power();
    assert_eq!((owner.heartbeat(), owner.read(0x2107, 0), owner.read(0x6200, 1)), (1000, 0, 0));
    owner.write("2107:00", 2, 7);
    owner.write("6200:01", 1, 9);
    owner.save(3);
    owner.cut_power();
    assert_eq!((owner.heartbeat(), owner.read(0x2107, 0), owner.read(0x6200, 1)), (1000, 0, 9));
}

#[test]
fn restored_defaults_take_effect_with_the_next_reset() {
    let mut owner = Owner::new();
    owner.write("1017:00", 2, 1000);
    owner.write("6200:01", 1, 9);
    owner.save(1);
    owner.restore(1);
    assert_eq!((owner.heartbeat(), owner.read(0x6200, 1)), (1000, 9), "nothing happens yet");
    owner.reset(RESET_COMMUNICATION);
    assert_eq!((owner.heartbeat(), owner.read(0x6200, 1)), (0, 9));
    owner.reset(RESET_NODE);
    assert_eq!((owner.heartbeat(), owner.read(0x6200, 1)), (0, 0));
    owner.cut_power();
    assert_eq!((owner.heartbeat(), owner.read(0x6200, 1)), (0, 0));
}

#[test]
fn groups_are_restored_apart() {
    let mut owner = Owner::new();
    owner.write("1017:00", 2, 1000);
    owner.write("2107:00", 2, 7);
    owner.write("6200:01", 1, 9);
    owner.save(1);
    owner.restore(2);
    owner.cut_power();
    assert_eq!((owner.heartbeat(), owner.read(0x2107, 0), owner.read(0x6200, 1)), (0, 7, 9));
    owner.restore(3);
    owner.cut_power();
    assert_eq!((owner.heartbeat(), owner.read(0x2107, 0), owner.read(0x6200, 1)), (0, 7, 0));
}

#[test]
fn a_saved_pdo_listens_with_its_saved_identifier_and_mapping() {
    let mut owner = Owner::new();
    owner.bench.map(0x1402, 0x0000_0432, 255, &[0x6200_0808]);
    owner.save(2);
    owner.cut_power();
    owner.bench.send("000#0101");
    owner.bench.send("432#2A");
    assert_eq!(owner.bench.value("6200:08"), 0x2A);
}

#[test]
fn commands_and_volatile_values_are_not_saved() {
    let mut owner = Owner::new();
    owner.write("2106:00", 2, 6); // a command
    owner.save(1);
    owner.cut_power();
    assert_eq!(owner.read(0x2106, 0), 0);
}

#[test]
fn the_answer_waits_until_all_is_stored_without_a_time_out() {
    let mut owner = Owner::new();
    owner.talk(
        "
        > 601#2310100173617665
        + 60s
        ",
    );
    assert_eq!(owner.order(), Some(Order::Save(Group::All)));
    owner.bench.node.stored(owner.bench.now, Ok(()));
    owner.talk(
        "
        < 581#6010100100000000
        + 60s
        ",
    );
    owner.bench.node.stored(owner.bench.now, Ok(()));
    owner.talk("");
}

#[test]
fn the_answer_waits_in_every_kind_of_transfer() {
    let mut owner = Owner::new();
    owner.talk(
        "
        > 601#2110100204000000 // segmented
        < 581#6010100200000000
        > 601#0773617665000000
        ",
    );
    owner.bench.node.stored(owner.bench.now, Ok(()));
    owner.talk(
        "
        < 581#2000000000000000
        > 601#C211100204000000 // block
        < 581#A41110027F000000
        > 601#816C6F6164000000
        < 581#A2017F0000000000
        > 601#CD00000000000000
        ",
    );
    assert_eq!(owner.order(), Some(Order::Restore(Group::Communication)));
    owner.bench.node.stored(owner.bench.now, Ok(()));
    owner.talk("< 581#A100000000000000");
}

#[test]
fn what_could_not_be_stored_is_said_06060000() {
    let mut owner = Owner::new();
    owner.write("1017:00", 2, 1000);
    owner.bench.send("601#2310100173617665");
    owner.bench.node.stored(owner.bench.now, Err(AbortCode::Hardware));
    owner.talk("< 581#8010100100000606");
    owner.bench.send("601#2311100273617665");
    owner.bench.send("601#231110026C6F6164");
    owner.bench.node.stored(owner.bench.now, Err(AbortCode::CannotStore));
    owner.talk("< 581#8011100220000008");
    owner.bench.events();
    owner.reset(RESET_NODE);
    assert_eq!(owner.heartbeat(), 0);
}

#[test]
fn one_order_at_a_time() {
    let mut owner = Owner::new();
    owner.talk(
        "
        > 601#2310100173617665
        > 601#4017100000000000 // the client does not wait any more
        < 581#4B17100000000000
        > 601#2310100273617665
        < 581#8010100222000008
        ",
    );
    owner.bench.node.stored(owner.bench.now, Ok(()));
    owner.talk("");
    owner.bench.events();
    owner.save(2);
}

#[test]
fn every_sdo_server_answers_its_own_client() {
    let mut owner = Owner::new();
    owner.bench.configure("1201:01", 0x6D0);
    owner.bench.configure("1201:02", 0x6D1);
    owner.bench.events();
    owner.talk(
        "
        > 6D0#2310100173617665
        > 601#4017100000000000 // another client
        < 581#4B17100000000000
        > 601#2310100273617665
        < 581#8010100222000008
        ",
    );
    owner.bench.node.stored(owner.bench.now, Ok(()));
    owner.talk("< 6D1#6010100100000000");
}

#[test]
fn an_abort_of_the_client_or_a_stop_takes_the_answer_with_it() {
    for end in ["601#8010100100000405", "000#0201", RESET_COMMUNICATION] {
        let mut owner = Owner::new();
        owner.bench.send("601#2310100173617665");
        owner.bench.send(end);
        owner.bench.node.stored(owner.bench.now, Ok(()));
        owner.talk("");
    }
}

// CCT 8.9
#[test]
fn the_verification_is_saved_with_the_parameters() {
    let mut owner = Owner::new();
    owner.write("1020:01", 4, 15_000);
    owner.write("1020:02", 4, 43_200_000);
    owner.write("1017:00", 2, 1000); // a tool may write in the order of the indices
    owner.save(1);
    owner.cut_power();
    assert_eq!((owner.read(0x1020, 1), owner.read(0x1020, 2)), (15_000, 43_200_000));
}

#[test]
fn any_later_change_of_a_parameter_voids_the_verification() {
    for (address, size, is_parameter) in
        [("1017:00", 2, true), ("6200:01", 1, true), ("2106:00", 2, false), ("1003:00", 1, false)]
    {
        let mut owner = Owner::new();
        owner.write("1020:01", 4, 15_000);
        owner.save(1);
        owner.write(address, size, 0);
        let expected = if is_parameter { 0 } else { 15_000 };
        assert_eq!(owner.read(0x1020, 1), expected, "{address}");
        owner.reset(RESET_COMMUNICATION);
        assert_eq!(owner.read(0x1020, 1), 15_000, "the stored ones are as they were");
        owner.write(address, size, 0);
        owner.save(3);
        owner.cut_power();
        assert_eq!(owner.read(0x1020, 1), expected, "it goes with every group, {address}");
    }
}

#[test]
fn restoring_defaults_voids_the_verification() {
    let mut owner = Owner::new();
    owner.write("1020:01", 4, 15_000);
    owner.save(1);
    owner.restore(3);
    assert_eq!(owner.read(0x1020, 1), 0);
    owner.cut_power();
    assert_eq!(owner.read(0x1020, 1), 0);
}

#[test]
fn the_data_sheet_is_read_from_the_device() {
    let mut owner = Owner::new();
    let sheet = owner.bench.upload(Address::new(0x1021, 0)).unwrap();
    assert_eq!(sheet, b"[FileInfo]\nFileName=bench.eds\n");
    assert_eq!(owner.bench.upload(Address::new(0x1022, 0)), Ok(vec![0]), "plain text");
    assert_eq!(owner.bench.download(Address::new(0x1021, 0), b"x"), Err(AbortCode::ReadOnly));
}
