//! Modbus clients: who they are, which device they mean, and what becomes of a device that hears no more of them.
//!
//! Whoever has the sockets tells of each client ([`Core::connect`]), hands over what it sends
//! ([`Core::receive`]), has its requests served one by one ([`Core::serve`]) and sends what it is answered
//! ([`Core::output`], [`Core::sent`]). What is due on a device before a request runs before it.

mod clients;
mod view;

use core::time::Duration;
use std::net::SocketAddr;
use std::sync::Arc;

use canopen::UNCONFIGURED;
use modbus::{Identification, Map, Permissions, Target};
use od::{Bus, Instant, Slot};
use profiles::Role;

use super::{Core, Notice, Unit, note};
use clients::Clients;
pub use clients::{Admission, ClientId, ClientStatus, ListenerCounters, Refused, WhenFull};
pub use view::{identification, map};

/// Where clients connect, and what they may do there.
#[derive(Clone, Debug, Default)]
pub struct ListenerPlan {
    /// Clients at a time.
    pub max_clients: u16,
    /// What becomes of one more.
    pub when_full: WhenFull,
    /// How long a client may ask for nothing.
    pub idle_timeout: Option<Duration>,
    /// What its clients may do, but for those that may only read.
    pub permissions: Permissions,
    /// The device that units 0 and 255 stand for.
    pub device: Option<usize>,
    /// Every unit stands for that device.
    pub is_own: bool,
}

/// How a device looks to Modbus clients.
#[derive(Clone, Debug)]
pub struct ModbusPlan {
    /// Its unit identifier; without it, the Node-ID that an LSS master has given to its first node that has one.
    pub unit: Option<u8>,
    /// Its registers.
    pub map: Arc<Map>,
    /// Who it says it is.
    pub identification: Identification,
    /// Silence of all clients after which their connection counts as lost, unless a register of the device says so.
    pub timeout: Option<Duration>,
}

/// A device as clients see it.
#[derive(Debug)]
struct View {
    plan: ModbusPlan,
    /// The register that holds the time-out in units of 100 ms, if the device has it.
    timeout_register: Option<Slot>,
    /// When the silence of the clients has been too long; none before the first request, and after it was.
    deadline: Option<Instant>,
}

/// Unit of the time-out register (Ethernet manual, section 8.2.10), of which the low 16 bits count.
const TIMEOUT_UNIT: Duration = Duration::from_millis(100);
/// Units that stand for the device itself (Messaging on TCP/IP V1.0b).
const ITSELF: [u8; 2] = [0, 255];

/// What the core has of Modbus.
#[derive(Debug, Default)]
pub(super) struct Modbus {
    /// For each device, if clients reach it.
    views: Vec<Option<View>>,
    listeners: Vec<ListenerPlan>,
    clients: Clients,
    /// Not after the first deadline of all clients and devices.
    pub(super) deadline: Option<Instant>,
}

impl Modbus {
    /// Where a client comes from.
    pub(super) fn peer(&self, client: u16) -> Option<SocketAddr> {
        self.clients.peer(ClientId(client))
    }

    /// Forgets a device.
    pub(super) fn leave(&mut self, device: usize) {
        self.views.get_mut(device).into_iter().for_each(|view| *view = None);
        let own = self.listeners.iter_mut().filter(|listener| listener.device == Some(device));
        own.for_each(|listener| listener.device = None);
    }

    /// The device whose unit this is, or that has no unit, if that is `None`.
    fn of_unit(&self, unit: Option<u8>) -> impl Iterator<Item = usize> {
        let views = self.views.iter().enumerate();
        let is_meant = move |view: &Option<View>| view.as_ref().is_some_and(|view| view.plan.unit == unit);
        views.filter(move |(_, view)| is_meant(view)).map(|(device, _)| device)
    }

    /// Makes sure that the core wakes up at `deadline`.
    fn wake(&mut self, deadline: Option<Instant>) {
        self.deadline = self.deadline.into_iter().chain(deadline).min();
    }
}

impl Core {
    /// Lets Modbus clients reach `device`; as what they reached it until now.
    pub fn show_on_modbus(&mut self, device: usize, plan: ModbusPlan) -> Option<ModbusPlan> {
        let unit = self.units.get(device)?;
        let timeout_register = unit.device.profile().registers.slot(Role::ModuleTimeout);
        if self.modbus.views.len() <= device {
            self.modbus.views.resize_with(device + 1, || None);
        }
        let place = self.modbus.views.get_mut(device)?;
        place.replace(View { plan, timeout_register, deadline: None }).map(|view| view.plan)
    }

    /// Lets no Modbus client reach `device` any more; as what they reached it.
    pub fn hide_from_modbus(&mut self, device: usize) -> Option<ModbusPlan> {
        self.modbus.views.get_mut(device)?.take().map(|view| view.plan)
    }

    /// Whether Modbus clients reach `device`.
    #[must_use]
    pub fn is_on_modbus(&self, device: usize) -> bool {
        self.modbus.views.get(device).is_some_and(Option::is_some)
    }

    /// Adds a place where clients connect; listeners are numbered from zero on.
    pub fn add_listener(&mut self, plan: ListenerPlan) {
        self.modbus.clients.add_listener(&plan);
        self.modbus.listeners.push(plan);
    }

    /// Makes `plan` that of a listener, a new one if it has the next number. Its clients stay as far as `admission` lets them,
    /// by where they come from; those whom it refuses are to be disconnected ([`Core::poll_closed`]).
    pub fn change_listener(
        &mut self,
        number: usize,
        plan: ListenerPlan,
        admission: impl Fn(SocketAddr) -> Admission,
    ) {
        let Some(listener) = self.modbus.listeners.get_mut(number) else { return self.add_listener(plan) };
        self.modbus.clients.change_listener(number, &plan, admission);
        *listener = plan;
    }

    /// Makes `device` the one that a listener stands for, or that units 0 and 255 stand for on it.
    pub fn set_listener_device(&mut self, number: usize, device: Option<usize>) {
        self.modbus.listeners.get_mut(number).into_iter().for_each(|listener| listener.device = device);
    }

    /// A client has connected.
    ///
    /// # Errors
    /// The listener has enough of them.
    pub fn connect(
        &mut self,
        now: Instant,
        listener: usize,
        peer: SocketAddr,
        reads_only: bool,
    ) -> Result<ClientId, Refused> {
        let Modbus { listeners, clients, .. } = &mut self.modbus;
        let plan = listeners.get(listener).ok_or(Refused)?;
        let client = clients.connect(now, listener, plan, peer, reads_only)?;
        let deadline = clients.get_mut(client).and_then(|server| server.poll_timeout());
        self.modbus.wake(deadline);
        Ok(client)
    }

    /// A client that was not to connect at all was sent away.
    pub fn turn_away(&mut self, listener: usize) {
        self.modbus.clients.turn_away(listener);
    }

    /// The connection of a client is over.
    pub fn disconnect(&mut self, client: ClientId) {
        self.modbus.clients.disconnect(client);
    }

    /// Bytes that [`Core::receive`] takes now.
    #[must_use]
    pub fn room(&self, client: ClientId) -> usize {
        self.modbus.clients.get(client).map_or(0, modbus::Server::room)
    }

    /// Takes bytes from a client.
    pub fn receive(&mut self, now: Instant, client: ClientId, bytes: &[u8]) {
        if let Some(server) = self.modbus.clients.get_mut(client) {
            server.handle_bytes(now, bytes);
        }
    }

    /// Whether a request of a client waits and has room for its answer.
    pub fn has_request(&mut self, client: ClientId) -> bool {
        self.modbus.clients.get_mut(client).is_some_and(|server| server.poll_request().is_some())
    }

    /// Serves the next request of a client; whether there was one.
    pub fn serve(&mut self, now: Instant, client: ClientId) -> bool {
        let Some(unit) = self.modbus.clients.get_mut(client).and_then(modbus::Server::poll_request) else {
            return false;
        };
        let listener = self.modbus.clients.listener(client).unwrap_or(usize::MAX);
        let device = self.find_unit(listener, unit);
        if let Some(device) = device.filter(|device| self.deadlines.is_due(*device, now)) {
            self.run_due(now, device);
        }
        self.answer(now, client, device);
        if let Some(device) = device {
            self.heard(now, device);
            self.note_commands(now, device);
            if self.units.get(device).is_some_and(|unit| unit.device.dictionary().has_written()) {
                self.settle(now, device);
                self.speak(now, device);
            }
        }
        self.pass(now);
        true
    }

    /// The device that a client of `listener` means by `unit`. What the configuration says comes before what an LSS
    /// master has given.
    fn find_unit(&self, listener: usize, unit: u8) -> Option<usize> {
        let plan = self.modbus.listeners.get(listener)?;
        if plan.is_own {
            return plan.device;
        }
        let node_id = |device| {
            let mut node_ids = self.nodes_of(device).map(|(_, node)| node.node_id());
            node_ids.find(|node_id| *node_id != UNCONFIGURED)
        };
        let mut configured = self.modbus.of_unit(Some(unit));
        let mut given = self.modbus.of_unit(None).filter(|device| node_id(*device) == Some(unit));
        let itself = || plan.device.filter(|_| ITSELF.contains(&unit));
        configured.next().or_else(|| given.next()).or_else(itself)
    }

    fn answer(&mut self, now: Instant, client: ClientId, device: Option<usize>) {
        let Self { units, modbus: Modbus { views, clients, .. }, .. } = self;
        let Some(server) = clients.serve(now, client) else { return };
        let target = device.and_then(|number| {
            let View { plan, .. } = views.get(number)?.as_ref()?;
            let Unit { device, members, .. } = units.get_mut(number)?;
            Some(Target {
                map: &plan.map,
                dictionary: device.dictionary_mut(),
                communication: members.first().map(|member| member.node.communication()),
                identification: &plan.identification,
            })
        });
        server.answer(now, target);
    }

    /// Begins the silence of the clients of a device anew.
    fn heard(&mut self, now: Instant, number: usize) {
        let Some(Unit { device, .. }) = self.units.get(number) else { return };
        let Some(Some(view)) = self.modbus.views.get_mut(number) else { return };
        let units = view.timeout_register.map_or(0, |slot| device.dictionary().raw(slot) as u16);
        let own = (units > 0).then(|| TIMEOUT_UNIT * u32::from(units));
        view.deadline = own.or(view.plan.timeout).map(|timeout| now + timeout);
        let deadline = view.deadline;
        self.modbus.wake(deadline);
    }

    /// Does what is due at `now` for clients and the devices that they left alone.
    pub(super) fn supervise_modbus(&mut self, now: Instant) {
        if self.modbus.deadline.is_none_or(|deadline| deadline > now) {
            return;
        }
        let mut next = self.modbus.clients.handle_timeout(now);
        for device in 0..self.modbus.views.len() {
            let Some(Some(view)) = self.modbus.views.get_mut(device) else { continue };
            if view.deadline.is_some_and(|deadline| deadline <= now) {
                view.deadline = None;
                self.lose_modbus(now, device);
            }
            let deadline = self.modbus.views.get(device).and_then(|view| view.as_ref()?.deadline);
            next = next.into_iter().chain(deadline).min();
        }
        self.modbus.deadline = next;
        self.pass(now);
    }

    /// The clients of a device are silent: it has lost its master, unless that is somebody else.
    fn lose_modbus(&mut self, now: Instant, number: usize) {
        if self.deadlines.is_due(number, now) {
            self.run_due(now, number);
        }
        let Some(Unit { device, .. }) = self.units.get_mut(number) else { return };
        let is_other = |axis| device.dictionary().owner(axis).is_some_and(|owner| owner.bus != Bus::Modbus);
        if device.profile().axes() > 0 && (0..device.profile().axes()).all(is_other) {
            return;
        }
        device.modbus_lost(now);
        note(&mut self.notices, &mut self.counters, number, Notice::ModbusLost);
        self.settle(now, number);
        self.speak(now, number);
    }

    /// The next client whose connection is to be closed: what it is still to be told is in its output.
    pub fn poll_closed(&mut self) -> Option<ClientId> {
        self.modbus.clients.poll_closed()
    }

    /// How many [`Core::poll_closed`] gives.
    #[must_use]
    pub fn closed(&self) -> usize {
        self.modbus.clients.closed()
    }

    /// What a client is to be sent.
    #[must_use]
    pub fn output(&self, client: ClientId) -> &[u8] {
        self.modbus.clients.get(client).map_or(&[], modbus::Server::output)
    }

    /// The first `length` bytes of the output of a client have left.
    pub fn sent(&mut self, client: ClientId, length: usize) {
        if let Some(server) = self.modbus.clients.get_mut(client) {
            server.sent(length);
        }
    }

    /// Whether the connection of a client is to be closed once its output has left.
    #[must_use]
    pub fn is_closing(&self, client: ClientId) -> bool {
        self.modbus.clients.get(client).is_none_or(modbus::Server::is_closing)
    }

    /// The clients that there are.
    pub fn modbus_clients(&self) -> impl Iterator<Item = ClientStatus> {
        self.modbus.clients.status()
    }

    /// What the listeners have done, in their order.
    pub fn modbus_listeners(&self) -> impl Iterator<Item = ListenerCounters> {
        self.modbus.clients.listeners()
    }
}
