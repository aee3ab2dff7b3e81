//! A moment of the calendar as a text.

use canopen::TimeOfDay;

/// Days from 1 March 0000 to 1 January 1984, in the Gregorian calendar.
const DAYS_TO_1984: u32 = 719_468 + 5113;
/// Days of 400, 100 and 4 years that begin in March, and of one.
const ERA: u32 = 146_097;
const CENTURY: u32 = 36_524;
const FOUR_YEARS: u32 = 1461;
const YEAR: u32 = 365;

/// Date and time, such as `2024-02-29 23:59:59.999`.
pub(super) fn text(TimeOfDay { days, millis }: TimeOfDay) -> String {
    let days = u32::from(days) + DAYS_TO_1984;
    let (era, day) = (days / ERA, days % ERA);
    let year = (day - day / (FOUR_YEARS - 1) + day / CENTURY - day / (ERA - 1)) / YEAR;
    let of_year = day - (YEAR * year + year / 4 - year / 100);
    // Months from March have 153 days in each five of them.
    let month = (5 * of_year + 2) / 153;
    let of_month = of_year - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let year = 400 * era + year + next;
    let (seconds, millis) = (millis / 1000, millis % 1000);
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    format!("{year:04}-{month:02}-{of_month:02} {hours:02}:{minutes:02}:{seconds:02}.{millis:03}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_dates() {
        for (days, millis, expected) in [
            (0, 0, "1984-01-01 00:00:00.000"),
            (14_610, 43_200_007, "2024-01-01 12:00:00.007"),
            (14_669, 86_399_999, "2024-02-29 23:59:59.999"),
            (14_670, 0, "2024-03-01 00:00:00.000"),
            (5844, 0, "2000-01-01 00:00:00.000"),
            (u16::MAX, 0x0FFF_FFFF, "2163-06-06 74:33:55.455"),
        ] {
            assert_eq!(text(TimeOfDay { days, millis }), expected);
        }
    }
}
