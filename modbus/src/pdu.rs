//! Requests as they stand in a PDU (Modbus Application Protocol V1.1b3, section 6).

use core::ops::RangeInclusive;

use od::Address;

use crate::{Dialect, Exception};

/// Function codes (section 5.1).
pub mod function {
    /// Read coils.
    pub const READ_COILS: u8 = 0x01;
    /// Read discrete inputs.
    pub const READ_DISCRETE_INPUTS: u8 = 0x02;
    /// Read holding registers.
    pub const READ_HOLDING_REGISTERS: u8 = 0x03;
    /// Read input registers.
    pub const READ_INPUT_REGISTERS: u8 = 0x04;
    /// Write single coil.
    pub const WRITE_SINGLE_COIL: u8 = 0x05;
    /// Write single register.
    pub const WRITE_SINGLE_REGISTER: u8 = 0x06;
    /// Diagnostics.
    pub const DIAGNOSTICS: u8 = 0x08;
    /// Write multiple coils.
    pub const WRITE_MULTIPLE_COILS: u8 = 0x0F;
    /// Write multiple registers.
    pub const WRITE_MULTIPLE_REGISTERS: u8 = 0x10;
    /// Report server identifier.
    pub const REPORT_SERVER_ID: u8 = 0x11;
    /// Mask write register.
    pub const MASK_WRITE_REGISTER: u8 = 0x16;
    /// Read/write multiple registers.
    pub const READ_WRITE_MULTIPLE_REGISTERS: u8 = 0x17;
    /// Encapsulated interface transport.
    pub const ENCAPSULATED_INTERFACE: u8 = 0x2B;
    /// What an exception adds to the function code.
    pub const EXCEPTION: u8 = 0x80;
}

/// MEI type of the CANopen General Reference (section 6.20).
pub(crate) const MEI_CANOPEN: u8 = 0x0D;
/// MEI type of Read Device Identification (section 6.21).
pub(crate) const MEI_IDENTIFICATION: u8 = 0x0E;
/// Diagnostics sub-function "return query data" (section 6.8.1).
pub(crate) const RETURN_QUERY_DATA: u16 = 0;
/// A coil that is switched on (section 6.5); zero switches it off.
const ON: u16 = 0xFF00;

/// Longest PDU in bytes (section 4.1).
pub const MAX_PDU: usize = 253;

/// Quantities one request may have (section 6.1 and on).
const READ_BITS: RangeInclusive<u16> = 1..=2000;
const WRITE_BITS: RangeInclusive<u16> = 1..=1968;

/// Tables of bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bits {
    /// Digital outputs.
    Coils,
    /// Digital inputs.
    DiscreteInputs,
}

/// Tables of registers. Both show the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Registers {
    /// By function code 3.
    Holding,
    /// By function code 4.
    Input,
}

/// How much of the identification is wanted (section 6.21).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum IdentificationCode {
    /// Objects 0-2, one after the other.
    Basic = 1,
    /// Objects 0-6.
    Regular = 2,
    /// All objects.
    Extended = 3,
    /// One object.
    Individual = 4,
}

/// An SDO in a Modbus request (function code 43, MEI type 13).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SdoRequest<'a> {
    /// Reads `length` bytes from byte `offset` on.
    Upload {
        /// The entry.
        address: Address,
        /// First byte wanted.
        offset: u16,
        /// Number of bytes wanted.
        length: u16,
    },
    /// Writes all of the entry.
    Download {
        /// The entry.
        address: Address,
        /// The value, little endian.
        data: &'a [u8],
    },
}

/// A request whose form is right. Registers to be written are bytes as they stand on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request<'a> {
    /// Function codes 1 and 2.
    ReadBits {
        /// Which table.
        table: Bits,
        /// First bit.
        start: u16,
        /// Number of bits, 1-2000.
        quantity: u16,
    },
    /// Function codes 3 and 4.
    ReadRegisters {
        /// Which table.
        table: Registers,
        /// First register.
        start: u16,
        /// Number of registers, 1-125.
        quantity: u16,
    },
    /// Function code 5.
    WriteCoil {
        /// The coil.
        address: u16,
        /// Its state.
        on: bool,
    },
    /// Function code 6.
    WriteRegister {
        /// The register.
        address: u16,
        /// Its value.
        value: [u8; 2],
    },
    /// Function code 8, sub-function 0: send the data back.
    ReturnQueryData {
        /// What is to come back.
        data: &'a [u8],
    },
    /// Function code 15.
    WriteCoils {
        /// First coil.
        start: u16,
        /// Number of coils, 1-1968.
        quantity: u16,
        /// Their states, lowest bit first.
        states: &'a [u8],
    },
    /// Function code 16.
    WriteRegisters {
        /// First register.
        start: u16,
        /// 1-123 registers.
        values: &'a [u8],
    },
    /// Function code 17.
    ReportServerId,
    /// Function code 22: `value = (value & and) | (or & !and)`.
    MaskWrite {
        /// The register.
        address: u16,
        /// The bits that stay.
        and: u16,
        /// What the others become.
        or: u16,
    },
    /// Function code 23; the registers are written before they are read.
    ReadWrite {
        /// First register to read.
        read_start: u16,
        /// Number of registers to read, 1-125.
        read_quantity: u16,
        /// First register to write.
        write_start: u16,
        /// 1-121 registers to write.
        values: &'a [u8],
    },
    /// Function code 43/13.
    Sdo(SdoRequest<'a>),
    /// Function code 43/14.
    Identification {
        /// How much is wanted.
        code: IdentificationCode,
        /// The first object, or the only one.
        object: u8,
    },
}

impl<'a> Request<'a> {
    /// Reads a PDU.
    ///
    /// # Errors
    /// [`Exception::IllegalFunction`] for a function that `dialect` does not have, [`Exception::IllegalDataValue`] for a
    /// length or quantity that is wrong; addresses are not looked at.
    pub fn decode(pdu: &'a [u8], dialect: Dialect) -> Result<Self, Exception> {
        let (&code, fields) = pdu.split_first().ok_or(Exception::IllegalDataValue)?;
        if !dialect.serves(code) {
            return Err(Exception::IllegalFunction);
        }
        let fields = Fields(fields);
        match code {
            function::READ_COILS => fields.read_bits(Bits::Coils),
            function::READ_DISCRETE_INPUTS => fields.read_bits(Bits::DiscreteInputs),
            function::READ_HOLDING_REGISTERS => fields.read_registers(Registers::Holding, dialect),
            function::READ_INPUT_REGISTERS => fields.read_registers(Registers::Input, dialect),
            function::WRITE_SINGLE_COIL => fields.write_coil(),
            function::WRITE_SINGLE_REGISTER => fields.write_register(),
            function::DIAGNOSTICS => fields.diagnostics(),
            function::WRITE_MULTIPLE_COILS => fields.write_coils(),
            function::WRITE_MULTIPLE_REGISTERS => fields.write_registers(dialect),
            function::REPORT_SERVER_ID => fields.end(Self::ReportServerId),
            function::MASK_WRITE_REGISTER => fields.mask_write(),
            function::READ_WRITE_MULTIPLE_REGISTERS => fields.read_write(dialect),
            function::ENCAPSULATED_INTERFACE => fields.encapsulated(),
            _ => Err(Exception::IllegalFunction),
        }
    }

    /// Appends the PDU to `out`, as a client sends it.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let start = out.len();
        out.push(self.function());
        let mut words = |words: &[u16]| words.iter().for_each(|word| out.extend(word.to_be_bytes()));
        match *self {
            Self::ReadBits { start, quantity, .. } | Self::ReadRegisters { start, quantity, .. } => {
                words(&[start, quantity]);
            }
            Self::WriteCoil { address, on } => words(&[address, if on { ON } else { 0 }]),
            Self::WriteRegister { address, value } => words(&[address, u16::from_be_bytes(value)]),
            Self::ReturnQueryData { data } => {
                words(&[RETURN_QUERY_DATA]);
                out.extend(data);
            }
            Self::WriteCoils { start, quantity, states } => {
                words(&[start, quantity]);
                counted(out, states);
            }
            Self::WriteRegisters { start, values } => {
                words(&[start, quantity_of(values)]);
                counted(out, values);
            }
            Self::ReportServerId => {}
            Self::MaskWrite { address, and, or } => words(&[address, and, or]),
            Self::ReadWrite { read_start, read_quantity, write_start, values } => {
                words(&[read_start, read_quantity, write_start, quantity_of(values)]);
                counted(out, values);
            }
            Self::Sdo(SdoRequest::Upload { address, offset, length }) => {
                sdo_header(out, SDO_READ, address, offset, length);
            }
            Self::Sdo(SdoRequest::Download { address, data }) => {
                sdo_header(out, SDO_WRITE, address, 0, data.len() as u16);
                out.extend(data);
            }
            Self::Identification { code, object } => out.extend([MEI_IDENTIFICATION, code as u8, object]),
        }
        debug_assert!(out.len() - start <= MAX_PDU, "a request longer than a PDU");
    }

    /// The function code.
    #[must_use]
    pub const fn function(&self) -> u8 {
        match self {
            Self::ReadBits { table: Bits::Coils, .. } => function::READ_COILS,
            Self::ReadBits { table: Bits::DiscreteInputs, .. } => function::READ_DISCRETE_INPUTS,
            Self::ReadRegisters { table: Registers::Holding, .. } => function::READ_HOLDING_REGISTERS,
            Self::ReadRegisters { table: Registers::Input, .. } => function::READ_INPUT_REGISTERS,
            Self::WriteCoil { .. } => function::WRITE_SINGLE_COIL,
            Self::WriteRegister { .. } => function::WRITE_SINGLE_REGISTER,
            Self::ReturnQueryData { .. } => function::DIAGNOSTICS,
            Self::WriteCoils { .. } => function::WRITE_MULTIPLE_COILS,
            Self::WriteRegisters { .. } => function::WRITE_MULTIPLE_REGISTERS,
            Self::ReportServerId => function::REPORT_SERVER_ID,
            Self::MaskWrite { .. } => function::MASK_WRITE_REGISTER,
            Self::ReadWrite { .. } => function::READ_WRITE_MULTIPLE_REGISTERS,
            Self::Sdo(_) | Self::Identification { .. } => function::ENCAPSULATED_INTERFACE,
        }
    }
}

/// What the control field of an SDO says.
const SDO_READ: u8 = 0;
const SDO_WRITE: u8 = 1;

/// The head of an SDO, request and answer alike: MEI type, control, reserved, Node-ID 0 (this device), index, sub-index,
/// first byte, number of bytes.
pub(crate) fn sdo_header(out: &mut Vec<u8>, control: u8, address: Address, offset: u16, length: u16) {
    out.extend([MEI_CANOPEN, control, 0, 0]);
    out.extend(address.index.to_be_bytes());
    out.push(address.sub);
    out.extend(offset.to_be_bytes());
    out.extend(length.to_be_bytes());
}

/// The head of the answer to `request`, which carries `length` bytes.
pub(crate) fn sdo_answer(out: &mut Vec<u8>, request: &SdoRequest<'_>, length: u16) {
    match *request {
        SdoRequest::Upload { address, offset, .. } => sdo_header(out, SDO_READ, address, offset, length),
        SdoRequest::Download { address, .. } => sdo_header(out, SDO_WRITE, address, 0, length),
    }
}

fn counted(out: &mut Vec<u8>, bytes: &[u8]) {
    out.push(bytes.len() as u8);
    out.extend(bytes);
}

fn quantity_of(values: &[u8]) -> u16 {
    (values.len() / 2) as u16
}

/// The bytes of a PDU behind the function code.
#[derive(Clone, Copy)]
struct Fields<'a>(&'a [u8]);

type Decoded<'a> = Result<Request<'a>, Exception>;

impl<'a> Fields<'a> {
    /// Splits off the first `N` bytes.
    fn take<const N: usize>(self) -> Result<([u8; N], Self), Exception> {
        let (head, rest) = self.0.split_first_chunk().ok_or(Exception::IllegalDataValue)?;
        Ok((*head, Self(rest)))
    }

    fn word(self) -> Result<(u16, Self), Exception> {
        let (bytes, rest) = self.take()?;
        Ok((u16::from_be_bytes(bytes), rest))
    }

    /// `request`, if nothing follows.
    fn end(self, request: Request<'a>) -> Decoded<'a> {
        if self.0.is_empty() { Ok(request) } else { Err(Exception::IllegalDataValue) }
    }

    /// All that follows, if a byte count says exactly that and it is `length` bytes.
    fn counted(self, length: usize) -> Result<&'a [u8], Exception> {
        let ([count], Self(bytes)) = self.take()?;
        let agrees = usize::from(count) == length && bytes.len() == length;
        if agrees { Ok(bytes) } else { Err(Exception::IllegalDataValue) }
    }

    fn read_bits(self, table: Bits) -> Decoded<'a> {
        let (start, rest) = self.word()?;
        let (quantity, rest) = rest.word()?;
        check(READ_BITS.contains(&quantity))?;
        rest.end(Request::ReadBits { table, start, quantity })
    }

    fn read_registers(self, table: Registers, dialect: Dialect) -> Decoded<'a> {
        let (start, rest) = self.word()?;
        let (quantity, rest) = rest.word()?;
        check(dialect.may_read(quantity))?;
        rest.end(Request::ReadRegisters { table, start, quantity })
    }

    fn write_coil(self) -> Decoded<'a> {
        let (address, rest) = self.word()?;
        let (state, rest) = rest.word()?;
        check(matches!(state, 0 | ON))?;
        rest.end(Request::WriteCoil { address, on: state == ON })
    }

    fn write_register(self) -> Decoded<'a> {
        let (address, rest) = self.word()?;
        let (value, rest) = rest.take()?;
        rest.end(Request::WriteRegister { address, value })
    }

    fn diagnostics(self) -> Decoded<'a> {
        match self.word()? {
            (RETURN_QUERY_DATA, Self(data)) => {
                check(!data.is_empty() && data.len().is_multiple_of(2))?;
                Ok(Request::ReturnQueryData { data })
            }
            (_, _) => Err(Exception::IllegalFunction),
        }
    }

    fn write_coils(self) -> Decoded<'a> {
        let (start, rest) = self.word()?;
        let (quantity, rest) = rest.word()?;
        check(WRITE_BITS.contains(&quantity))?;
        let states = rest.counted(usize::from(quantity).div_ceil(8))?;
        Ok(Request::WriteCoils { start, quantity, states })
    }

    fn write_registers(self, dialect: Dialect) -> Decoded<'a> {
        let (start, rest) = self.word()?;
        let (quantity, rest) = rest.word()?;
        check(dialect.may_write(quantity))?;
        let values = rest.counted(2 * usize::from(quantity))?;
        Ok(Request::WriteRegisters { start, values })
    }

    fn mask_write(self) -> Decoded<'a> {
        let (address, rest) = self.word()?;
        let (and, rest) = rest.word()?;
        let (or, rest) = rest.word()?;
        rest.end(Request::MaskWrite { address, and, or })
    }

    fn read_write(self, dialect: Dialect) -> Decoded<'a> {
        let (read_start, rest) = self.word()?;
        let (read_quantity, rest) = rest.word()?;
        let (write_start, rest) = rest.word()?;
        let (write_quantity, rest) = rest.word()?;
        check(dialect.may_read(read_quantity) && dialect.may_read_and_write(write_quantity))?;
        let values = rest.counted(2 * usize::from(write_quantity))?;
        Ok(Request::ReadWrite { read_start, read_quantity, write_start, values })
    }

    fn encapsulated(self) -> Decoded<'a> {
        match self.take()? {
            ([MEI_CANOPEN], rest) => rest.sdo(),
            ([MEI_IDENTIFICATION], rest) => rest.identification(),
            (_, _) => Err(Exception::IllegalFunction),
        }
    }

    fn sdo(self) -> Decoded<'a> {
        let ([control, reserved, node], rest) = self.take()?;
        let (index, rest) = rest.word()?;
        let ([sub], rest) = rest.take()?;
        let (offset, rest) = rest.word()?;
        let (length, Self(data)) = rest.word()?;
        check(reserved == 0 && node == 0)?;
        let address = Address::new(index, sub);
        match control {
            SDO_READ if data.is_empty() => Ok(Request::Sdo(SdoRequest::Upload { address, offset, length })),
            SDO_WRITE if offset == 0 && data.len() == usize::from(length) => {
                Ok(Request::Sdo(SdoRequest::Download { address, data }))
            }
            _ => Err(Exception::IllegalDataValue),
        }
    }

    fn identification(self) -> Decoded<'a> {
        let ([code, object], rest) = self.take()?;
        let code = match code {
            1 => IdentificationCode::Basic,
            2 => IdentificationCode::Regular,
            3 => IdentificationCode::Extended,
            4 => IdentificationCode::Individual,
            _ => return Err(Exception::IllegalDataValue),
        };
        rest.end(Request::Identification { code, object })
    }
}

fn check(is_right: bool) -> Result<(), Exception> {
    if is_right { Ok(()) } else { Err(Exception::IllegalDataValue) }
}
