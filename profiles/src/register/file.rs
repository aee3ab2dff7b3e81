//! The registers of one axis in its dictionary, by role and by number.

use od::{Dictionary, Schema, Slot, SlotTable};

use super::{Format, RegisterList, Role, Space};

/// Where the registers of an axis are kept and how they hold what they show. It has no values: those are in the
/// dictionary, and all devices of a kind share one register file.
#[derive(Clone, Debug)]
pub struct RegisterFile {
    cells: Vec<Cell>,
    /// Position in `cells` of the register that an entry shows.
    slots: SlotTable<u16>,
    /// Position in `cells` of each role that the device has.
    roles: [Option<u16>; Role::COUNT],
    /// Position in `cells` of each motor register that an entry shows, by number.
    numbers: Vec<Option<u16>>,
}

/// One register that is shown by an entry.
#[derive(Clone, Copy, Debug)]
struct Cell {
    slot: Slot,
    format: Format,
    /// A register of 32 bits that takes two numbers and its high word have each other.
    partner: Option<Slot>,
    /// A high word has that of the whole register.
    role: Option<Role>,
    space: Space,
    number: u16,
}

/// A register that a bus has written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct WrittenRegister {
    /// Whose it is.
    pub(crate) space: Space,
    /// Its meaning, if behaviours may ask for it; that of the whole register for a high word.
    pub(crate) role: Option<Role>,
}

impl Default for RegisterFile {
    /// The registers of a device that has none.
    fn default() -> Self {
        Self {
            cells: Vec::new(),
            slots: SlotTable::default(),
            roles: [None; Role::COUNT],
            numbers: Vec::new(),
        }
    }
}

impl RegisterFile {
    /// The registers of `motor` and `module` among the entries of `schema`.
    pub(crate) fn new(schema: &Schema, motor: Option<&RegisterList>, module: Option<&RegisterList>) -> Self {
        let motor_cells = motor.into_iter().flat_map(|list| cells(schema, list, Space::Motor));
        let module_cells = module.into_iter().flat_map(|list| cells(schema, list, Space::Module));
        let cells: Vec<Cell> = motor_cells.chain(module_cells).collect();
        let mut file = Self::default();
        file.numbers.resize(motor.map_or(0, |list| list.registers.len()), None);
        for (position, cell) in (0_u16..).zip(&cells) {
            let role = cell.role.filter(|_| cell.format != Format::HighWord);
            if let Some(place) = role.and_then(|role| file.roles.get_mut(role as usize)) {
                *place = Some(position);
            }
            if let Some(place) =
                file.numbers.get_mut(usize::from(cell.number)).filter(|_| cell.space == Space::Motor)
            {
                *place = Some(position);
            }
        }
        file.slots = (0_u16..).zip(&cells).map(|(position, cell)| (cell.slot, position)).collect();
        file.cells = cells;
        file
    }

    /// The slot of the register with this role, if the device has it.
    #[must_use]
    pub fn slot(&self, role: Role) -> Option<Slot> {
        self.by_role(role).map(|cell| cell.slot)
    }

    /// What the register with this role holds, if the device has it. All 32 bits of a pattern are kept.
    #[must_use]
    pub fn get(&self, dictionary: &Dictionary, role: Role) -> Option<i32> {
        self.by_role(role).map(|cell| read(dictionary, cell))
    }

    /// Shows `value` in the register with this role, if the device has it; the nearest that it can hold.
    pub fn show(&self, dictionary: &mut Dictionary, role: Role, value: i32) {
        if let Some(cell) = self.by_role(role) {
            show(dictionary, cell, cell.format.nearest(value));
        }
    }

    /// What motor register `number` holds: zero if it is reserved, `None` above the last one.
    #[must_use]
    pub fn read_number(&self, dictionary: &Dictionary, number: u16) -> Option<i32> {
        let position = self.numbers.get(usize::from(number))?;
        Some(position.and_then(|at| self.cells.get(usize::from(at))).map_or(0, |cell| read(dictionary, cell)))
    }

    /// Gives motor register `number` the bits of `value` as if they were written, whatever its access; the motor
    /// itself does that. Nothing happens to a reserved one.
    pub fn show_number(&self, dictionary: &mut Dictionary, number: u16, value: i32) {
        let position = self.numbers.get(usize::from(number)).copied().flatten();
        if let Some(cell) = position.and_then(|at| self.cells.get(usize::from(at))) {
            dictionary.set(cell.slot, value.cast_unsigned().into());
            self.normalise(dictionary, cell.slot);
        }
    }

    /// The role of the register at `slot`; that of the whole register for a high word.
    #[must_use]
    pub fn role_of(&self, slot: Slot) -> Option<Role> {
        self.by_slot(slot)?.role
    }

    /// The role of motor register `number`.
    #[must_use]
    pub fn role_of_number(&self, number: u16) -> Option<Role> {
        let position = self.numbers.get(usize::from(number)).copied().flatten()?;
        self.role_of(self.cells.get(usize::from(position))?.slot)
    }

    /// The number of the register at `slot`, of motor or module.
    #[must_use]
    pub fn number_of(&self, slot: Slot) -> Option<u16> {
        self.by_slot(slot).map(|cell| cell.number)
    }

    /// Gives what a bus has just written at `slot` the form that its register has: the low 16 bits of a word, zero for
    /// a reserved number. A high word that was written replaces that of the register before; when both were written
    /// at once, it does so afterwards. Which register it is, if it is one.
    pub(crate) fn normalise(&self, dictionary: &mut Dictionary, slot: Slot) -> Option<WrittenRegister> {
        let cell = self.by_slot(slot)?;
        let raw = cell.format.take(dictionary.raw(slot) as u32);
        match (cell.format, cell.partner) {
            (Format::HighWord, Some(whole)) => {
                let low = dictionary.raw(whole) as u16;
                dictionary.set(slot, raw.into());
                dictionary.set(whole, u64::from(raw << 16 | u32::from(low)));
            }
            (_, Some(high)) if dictionary.is_written(high) => {}
            // It holds what was written.
            (Format::I32 | Format::U32, None) => {}
            _ => show(dictionary, cell, raw),
        }
        Some(WrittenRegister { space: cell.space, role: cell.role })
    }

    /// Makes all high words those of their registers, after these have got their power-on values.
    pub fn refresh(&self, dictionary: &mut Dictionary) {
        for cell in &self.cells {
            if cell.format != Format::HighWord {
                let raw = cell.format.take(dictionary.raw(cell.slot) as u32);
                show(dictionary, cell, raw);
            }
        }
    }

    fn by_role(&self, role: Role) -> Option<&Cell> {
        let position = self.roles.get(role as usize).copied().flatten()?;
        self.cells.get(usize::from(position))
    }

    fn by_slot(&self, slot: Slot) -> Option<&Cell> {
        self.cells.get(usize::from(self.slots.get(slot)?))
    }
}

/// The registers of a list that entries show.
fn cells<'l>(schema: &'l Schema, list: &'l RegisterList, space: Space) -> impl Iterator<Item = Cell> + 'l {
    let slot_of = |number: u16| schema.slot(list.get(number)?.place?);
    list.registers.iter().filter_map(move |register| {
        let next = register.number.checked_add(1);
        let has_high = next.and_then(|n| list.get(n)).is_some_and(|high| high.format == Format::HighWord);
        let before = register.number.checked_sub(1);
        let (partner, role) = match register.format {
            Format::HighWord => (before, before.and_then(|number| list.get(number)?.role)),
            _ => (next.filter(|_| has_high), register.role),
        };
        Some(Cell {
            slot: slot_of(register.number)?,
            format: register.format,
            partner: partner.and_then(slot_of),
            role,
            space,
            number: register.number,
        })
    })
}

/// Entries hold registers sign-extended already; one that shows an entry of another object has the type of that.
fn read(dictionary: &Dictionary, cell: &Cell) -> i32 {
    dictionary.integer(cell.slot) as i64 as i32
}

fn show(dictionary: &mut Dictionary, cell: &Cell, raw: u32) {
    dictionary.set(cell.slot, raw.into());
    if let (Format::I32 | Format::U32, Some(high)) = (cell.format, cell.partner) {
        dictionary.set(high, u64::from(Format::HighWord.take(raw >> 16)));
    }
}
