//! The shipped profiles.

use profiles::Profile;

#[test]
fn every_shipped_profile_loads_with_every_motor() {
    for name in Profile::names() {
        let default = Profile::embedded(name, None).unwrap();
        let default = default.unwrap_or_else(|wrong| panic!("{wrong}"));
        assert_eq!(default.name, name);
        for motor in &default.motors {
            let profile = Profile::embedded(name, Some(motor)).unwrap().unwrap();
            assert_eq!(&profile.motor.name, motor);
        }
    }
}
