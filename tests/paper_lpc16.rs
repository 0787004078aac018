//! The equations of Lotufo et al., MED 2016, each with the paper's numbers. `print` is what the paper prints.

mod control_unit {
    use nalgebra::{Matrix2, Matrix3, Matrix3x2, Matrix4, Matrix5, RowVector2, Vector3, Vector5};
    use rotorbench::control::design::LoopPlant;
    use rotorbench::control::gains::{
        complementary_eigenvalues, feedback_gains, feedback_matrix, observer_gains, predictor_matrix,
    };
    use rotorbench::control::{
        Allocator, AnyController, Beta, BetaRule, Compensation, ControlError, Controller, ControllerConfig,
        ControllerKind, EmcConfig, PlantParameters,
    };
    use rotorbench::signal::{Applied, Command, CommandFlags, Reference, Sample, Sensors};

    const T_C: f64 = 0.02;
    const BETA: f64 = 0.276;

    /// Rounds to as many significant digits as the paper prints.
    fn printed(value: f64, digits: usize) -> f64 {
        format!("{value:.*e}", digits - 1).parse().expect("a number")
    }

    fn close(value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() <= tolerance, "{value} is not {expected} within {tolerance}");
    }

    fn spectral_radius(eigenvalues: &[nalgebra::Complex<f64>]) -> f64 {
        eigenvalues.iter().fold(0.0, |most, value| value.norm().max(most))
    }

    #[test]
    fn eqs_13_14_and_table_iv_hover_point_and_torque_gain() {
        let plant = PlantParameters::paper();
        // Eq. (14): b = d c_p1 / J.
        close(plant.torque_gain(), 0.153_91, 5e-6);
        close(plant.thrust_coefficient, 1.5965e-5, 5e-10);
        close(plant.hover_rate, 617.0, 0.05);
        // The tangent of Table IV, Eq. (13), touches c ω² at hover.
        let thrust = plant.thrust_coefficient * plant.hover_rate * plant.hover_rate;
        close(thrust, 0.0197 * plant.hover_rate - 6.0771, 1e-12);
        close(thrust, 6.077, 5e-4);
        close(2.0 * plant.thrust_coefficient * plant.hover_rate, plant.thrust_slope, 1e-15);
        close(plant.command_for(plant.hover_rate), 0.4633, 5e-5);
    }

    #[test]
    fn eq_7_has_an_inverse_over_the_whole_range() {
        let plant = PlantParameters::paper();
        close(plant.steady_rate(1.0), 447.1 + 1124.5, 1e-12);
        for step in 0..=1000 {
            let u = f64::from(step) / 1000.0;
            // The rounding of a root of numbers near 1000, over a slope above 1000.
            close(plant.command_for(plant.steady_rate(u)), u, 1e-14);
        }
        let straight = PlantParameters { steady_rate_quadratic: 0.0, ..plant };
        close(straight.command_for(562.25), 0.5, 1e-15);
    }

    /// q̇_b = -p q_b + p b u_x in 4000 midpoint steps a period, against the plant that margins are computed on.
    #[test]
    fn eqs_14_15_17_from_the_command_to_the_gyro() {
        let plant = PlantParameters::paper();
        let sampled = LoopPlant::new(&plant).sampled(T_C).expect("the paper's plant");
        let (mut x, mut q, mut rate, mut fastest) = (sampled.b.clone() * 0.0, 0.0_f64, 0.0_f64, 0.0_f64);
        for k in 0..100 {
            // The gyro's sample belongs to the beginning of the period.
            close(sampled.c.dot(&x), rate, 1e-9);
            fastest = fastest.max(rate.abs());
            let u_x = if k % 7 < 3 { 60.0 } else { -45.0 };
            x = &sampled.a * &x + &sampled.b * (plant.inertia * plant.torque_gain() * u_x);
            let step = T_C / 4000.0;
            for _ in 0..4000 {
                let slope = |q: f64| -plant.pole * q + plant.pole * plant.torque_gain() * u_x;
                let middle = q + 0.5 * step * slope(q);
                rate += step * middle;
                q += step * slope(middle);
            }
        }
        assert!(fastest > 0.3, "it moved: {fastest} rad/s");
    }

    #[test]
    fn beta_by_zero_order_hold_by_euler_and_as_given() {
        close(Beta::Rule(BetaRule::ZeroOrderHold).value(16.0, T_C), 0.2739, 5e-5);
        close(Beta::Rule(BetaRule::Euler).value(16.0, T_C), 0.32, 1e-15);
        close(Beta::Value(0.276).value(16.0, T_C), 0.276, 0.0);
    }

    #[test]
    fn eq_27_and_table_ii_eigenvalues() {
        let gamma: [f64; 4] = complementary_eigenvalues(BETA, 1.2);
        for (value, expected) in gamma.into_iter().zip([0.276, 0.120, 0.052, 0.023]) {
            close((value * 1000.0).round() / 1000.0, expected, 1e-15);
        }
        for (value, expected) in gamma.into_iter().zip([0.276, 0.120_14, 0.052_29, 0.022_76]) {
            close(value, expected, 5e-6);
        }
    }

    #[test]
    fn eq_26_and_table_ii_gains() {
        let [l_0, l_1, l_2, l_3] = observer_gains(BETA, complementary_eigenvalues(BETA, 1.2));
        // The paper's -5.03e-17 is the rounding of its own arithmetic; zero is the exact value for γ_0 = β.
        assert!(l_0.abs() < 1e-15, "{l_0}");
        assert_eq!([printed(l_1, 3), printed(l_2, 3), printed(l_3, 3)], [1.95e-1, 1.02e-2, 1.43e-4]);
        close(l_1, 0.195_19, 5e-6);
        close(l_2, 0.010_207, 5e-7);
        close(l_3, 1.4299e-4, 5e-9);
    }

    #[test]
    fn eqs_25_26_27_agree_on_polynomial_and_eigenvalues() {
        for (beta, gamma_0, alpha) in [(0.276, 0.276, 1.2), (0.32, 0.2, 0.4), (0.02, 0.05, 2.0)] {
            let gamma = complementary_eigenvalues(gamma_0, alpha);
            let l = observer_gains(beta, gamma);
            let a = predictor_matrix(beta, l);
            for gamma in gamma {
                // det((1 - γ) I - A) = p(-γ), in the paper's sign γ = λ - 1.
                let determinant = (Matrix4::identity() * (1.0 - gamma) - a).determinant();
                close(determinant, 0.0, 1e-15);
                let g = -gamma;
                let [l_0, l_1, l_2, l_3] = l;
                let p = g.powi(4)
                    + (beta + l_1) * g.powi(3)
                    + (l_2 + beta * l_1 + beta * l_0) * g * g
                    + (l_3 + beta * l_2) * g
                    + beta * l_3;
                close(p, 0.0, 1e-15);
            }
        }
    }

    #[test]
    fn table_iii_printed_k_is_unstable_and_refused() {
        let print = [0.276, 0.120, 0.052];
        let eigenvalues = feedback_matrix(BETA, print).complex_eigenvalues();
        close(spectral_radius(eigenvalues.as_slice()), 1.171, 5e-4);

        let config = ControllerConfig {
            emc: EmcConfig { feedback_gain: Some(print), ..ControllerConfig::paper().emc },
            ..ControllerConfig::paper()
        };
        let error = config.build(&PlantParameters::paper(), T_C).unwrap_err();
        assert!(
            matches!(error, ControlError::Unstable { modulus, .. } if (modulus - 1.171).abs() < 5e-4),
            "{error}"
        );
        assert!(error.to_string().contains("A_c - B_c K is unstable: eigenvalue 1.1"), "{error}");
    }

    #[test]
    fn table_iii_by_pole_placement() {
        let k = feedback_gains(BETA, complementary_eigenvalues(BETA, 0.0));
        for (value, expected) in k.into_iter().zip([0.076_18, 0.828, 2.0]) {
            close(value, expected, 5e-6);
        }
        // A triple eigenvalue splits by the cube root of the rounding.
        close(spectral_radius(feedback_matrix(BETA, k).complex_eigenvalues().as_slice()), 0.724, 1e-4);

        let slow = feedback_gains(BETA, complementary_eigenvalues(BETA, 1.2));
        for (value, expected) in slow.into_iter().zip([0.006_28, 0.1952, 0.6247]) {
            close(value, expected, 5e-5);
        }
        close(spectral_radius(feedback_matrix(BETA, slow).complex_eigenvalues().as_slice()), 0.948, 5e-4);
    }

    #[test]
    fn eq_29_solves_the_sylvester_equation() {
        let a_c = Matrix3::new(1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0 - BETA);
        let a_d = Matrix2::new(1.0, 1.0, 0.0, 1.0);
        let h_c = Matrix3x2::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
        let b_c = Vector3::new(0.0, 0.0, BETA);
        let m = RowVector2::new(1.0, 1.0 / BETA);
        let q = Matrix3x2::new(0.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        assert!((a_c * q - q * a_d - h_c + b_c * m).abs().max() < 1e-15);
    }

    #[test]
    fn eqs_16_to_19_allocate_and_come_back() {
        let plant = PlantParameters::paper();
        let allocator = Allocator::build(&plant, &Compensation::default()).expect("the paper's plant");
        for voltage in [12.6, 11.1, 9.9] {
            for difference in [-600.0, -40.0, 0.0, 1e-3, 250.0] {
                let allocation = allocator.allocate(difference, voltage);
                assert!(!allocation.saturated);
                // The difference of two rates near 1000, back from the inverse of g.
                close(allocator.difference(allocation.rotor, voltage), difference, 1e-9);
                // Eq. (2), with the sign of Eq. (6): both rotors settle around hover on any battery.
                let z = allocation.rotor.map(|u| plant.steady_rate(u) - 40.0 * (12.6 - voltage));
                close(z[0] - z[1], difference, 1e-9);
                close(0.5 * (z[0] + z[1]), plant.hover_rate, 1e-9);
                // Torque of the quadratic thrust: exactly linear, d c_p1 u_x.
                let torque = plant.arm * plant.thrust_coefficient * (z[0] * z[0] - z[1] * z[1]);
                close(torque, plant.inertia * plant.torque_gain() * difference, 1e-9);
            }
        }
        let beyond = allocator.allocate(2000.0, 12.6);
        assert!(beyond.saturated && beyond.rotor[1] == 0.0 && beyond.rotor[0] <= 1.0);
        let empty = allocator.allocate(0.0, 0.0);
        assert!(!empty.saturated, "504 rad/s of sag still leave hover in reach: {empty:?}");
        let drained = PlantParameters { voltage_gain: 100.0, ..plant };
        let drained = Allocator::build(&drained, &Compensation::default()).expect("builds");
        assert!(drained.allocate(0.0, 0.0).saturated);
    }

    fn sensors(sequence: u32, body_rate: f64) -> Sensors {
        let stamp = 1_000_000 * u64::from(sequence);
        Sensors {
            sequence: u64::from(sequence),
            stamp_ns: stamp,
            body_rate: Sample::good(body_rate, stamp, sequence),
            battery_voltage: Sample::good(12.1, stamp, sequence),
            ..Sensors::default()
        }
    }

    fn let_through(command: &Command) -> Applied {
        Applied {
            sequence: command.sequence,
            command_sequence: command.sequence,
            rotor: command.rotor,
            ..Applied::default()
        }
    }

    fn build(kind: ControllerKind) -> AnyController {
        let config = ControllerConfig { kind, ..ControllerConfig::paper() };
        config.build(&PlantParameters::paper(), T_C).expect("the paper's controller")
    }

    /// Once more, as the paper writes them: matrices, no shared code.
    #[test]
    fn eqs_20_to_25_and_28_emc_step_is_the_matrix_form_of_the_paper() {
        let emc = build(ControllerKind::Emc);
        let mut state = emc.start();
        let [l_0, l_1, l_2, l_3] = observer_gains(BETA, complementary_eigenvalues(BETA, 1.2));
        let k = feedback_gains(BETA, complementary_eigenvalues(BETA, 0.0));
        let j = 0.032;
        let mut x = Vector5::<f64>::zeros();
        let mut applied = Applied::default();
        for i in 1..200_u32 {
            let rate = 0.5 * (0.21 * f64::from(i)).sin() + 0.1 * (1.7 * f64::from(i)).cos();
            let reference = Reference { angle: 0.1, rate: 0.02, acceleration: -0.3, jerk: 1.5 };
            let command = emc.step(&mut state, &sensors(i, rate), &reference, &applied);

            let y = T_C * rate;
            if i == 1 {
                x[1] = y; // at rest at the measured rate until the first command is let through
            }
            let r = Vector3::new(0.1, T_C * 0.02, T_C * T_C * -0.3);
            let nominal = r[2] + T_C.powi(3) * 1.5 / BETA;
            let q_x_d = Vector3::new(0.0, 0.0, x[3]);
            let e = r - x.fixed_rows::<3>(0) - q_x_d;
            let u = nominal + Vector3::from(k).dot(&e) - (x[3] + x[4] / BETA);
            close(command.torque, j / (T_C * T_C) * u, 1e-9);
            close(command.estimate.disturbance_torque, j / (T_C * T_C) * x[3], 1e-9);
            close(command.estimate.body_angle, x[0], 1e-12);
            close(command.estimate.model_error, (x[1] - y) / T_C, 1e-10);
            #[rustfmt::skip]
            let a = Matrix5::new(
                1.0, 1.0,         0.0,        0.0, 0.0,
                0.0, 1.0 - l_1,   1.0,        1.0, 0.0,
                0.0, -BETA * l_0, 1.0 - BETA, 0.0, 0.0,
                0.0, -l_2,        0.0,        1.0, 1.0,
                0.0, -l_3,        0.0,        0.0, 1.0
            );
            // The angle integrates the estimated rate: it is not observable from the gyro.
            x = a * x
                + Vector5::new(0.0, 0.0, BETA, 0.0, 0.0) * u
                + Vector5::new(0.0, l_1, BETA * l_0, l_2, l_3) * y;
            applied = let_through(&command);
        }
    }

    #[test]
    fn emc_believes_what_the_guard_let_through_and_not_what_it_asked_for() {
        let emc = build(ControllerKind::Emc);
        let mut state = emc.start();
        let asked = emc.step(&mut state, &sensors(1, 0.4), &Reference::default(), &Applied::default());
        assert!(asked.torque < -0.1);
        let nothing = Applied { rotor: [0.4, 0.4], ..let_through(&asked) };
        let after = emc.step(&mut state, &sensors(2, 0.4), &Reference::default(), &nothing);
        close(after.estimate.actuator_acceleration, 0.0, 1e-12);
    }

    #[test]
    fn a_missing_gyro_sample_is_predicted_and_flagged() {
        for kind in [ControllerKind::Emc, ControllerKind::Pid] {
            let controller = build(kind);
            let mut state = controller.start();
            let reference = Reference::default();
            let first = controller.step(&mut state, &sensors(1, 0.4), &reference, &Applied::default());
            assert_eq!(first.flags & CommandFlags::SENSOR_MISSING, 0);
            // The same sample again, and one that is no number: neither is a measurement.
            let mut bad = sensors(2, f64::NAN);
            for missing in [sensors(1, 0.4), bad] {
                let command = controller.step(&mut state, &missing, &reference, &let_through(&first));
                assert_eq!(command.flags & CommandFlags::SENSOR_MISSING, CommandFlags::SENSOR_MISSING);
                assert!(command.torque.is_finite() && command.estimate.body_angle > 0.0);
                close(command.estimate.model_error, 0.0, 0.0);
            }
            bad.battery_voltage = Sample::never();
            let command = controller.step(&mut state, &bad, &reference, &let_through(&first));
            assert_eq!(command.flags & CommandFlags::VOLTAGE_ASSUMED, CommandFlags::VOLTAGE_ASSUMED);
        }
    }

    #[test]
    fn eq_30_with_the_gains_of_table_iii() {
        let pid = build(ControllerKind::Pid);
        let mut state = pid.start();
        let reference = Reference { angle: 0.1, ..Reference::default() };
        let (mut angle, mut x_i) = (0.0, 0.0);
        let mut applied = Applied::default();
        for i in 1..100_u32 {
            let rate = 0.05 * (0.3 * f64::from(i)).sin();
            let command = pid.step(&mut state, &sensors(i, rate), &reference, &applied);
            let e = 0.1 - angle;
            let x_2 = T_C * rate;
            close(command.torque, 2.248 * e - 0.574 / T_C * x_2 + 0.985 * T_C * x_i, 1e-12);
            // The bench was at rest until now: the integral begins with the first command let through.
            x_i += if i > 1 { e } else { 0.0 };
            angle += x_2;
            applied = let_through(&command);
        }
    }

    #[test]
    fn pid_integral_stops_where_the_guard_clips() {
        let pid = build(ControllerKind::Pid);
        let reference = Reference { angle: 0.5, ..Reference::default() };
        let integral = |flags: u32, rotor: Option<[f64; 2]>| {
            let mut state = pid.start();
            let mut applied = Applied::default();
            let mut last = 0.0;
            for i in 1..50 {
                let command = pid.step(&mut state, &sensors(i, 0.0), &reference, &applied);
                last = command.estimate.disturbance_torque;
                applied = Applied { flags, ..let_through(&command) };
                applied.rotor = rotor.unwrap_or(applied.rotor);
            }
            last
        };
        close(integral(0, None), 0.985 * T_C * 0.5 * 47.0, 1e-9);
        close(integral(1, Some([0.47, 0.46])), 0.0, 0.0);
        // Clipped, yet the rotors already do more than was asked for: the integral may go on.
        assert!(integral(1, Some([0.9, 0.1])) > 0.4);
    }

    #[test]
    fn a_disarmed_bench_does_not_wind_up() {
        for kind in [ControllerKind::Emc, ControllerKind::Pid] {
            let controller = build(kind);
            let mut state = controller.start();
            let mut command = Command::default();
            for i in 1..3000 {
                command = controller.step(
                    &mut state,
                    &sensors(i, 0.01),
                    &Reference::default(),
                    &Applied::default(),
                );
            }
            close(command.estimate.body_angle, 0.0, 0.0);
            close(command.estimate.disturbance_torque, 0.0, 0.0);
        }
    }
}

/// What the print gets wrong, marked in the code and listed in the README; and a test for every equation used.
mod bookkeeping {
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::{Path, PathBuf};

    const MARK: &str = "**Deviation:**";

    fn root() -> &'static Path {
        Path::new(env!("CARGO_MANIFEST_DIR"))
    }

    fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("src is readable") {
            let path = entry.expect("entry is readable").path();
            if path.is_dir() {
                sources(&path, into);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                into.push(path);
            }
        }
    }

    /// Room, and text, of every file of the library.
    fn library() -> Vec<(String, String)> {
        let source = root().join("src");
        let mut paths = Vec::new();
        sources(&source, &mut paths);
        let each = paths.iter().map(|path| {
            let below = path.strip_prefix(&source).expect("below src").display().to_string();
            let room = below.split(['/', '.']).next().unwrap_or_default().to_owned();
            (room, fs::read_to_string(path).expect("readable"))
        });
        each.collect()
    }

    /// `(7)`, `Table IV` and `Fig. 4`, wherever the text names one.
    fn places(text: &str) -> BTreeSet<String> {
        let mut places = BTreeSet::new();
        for (at, _) in text.match_indices('(') {
            let inside: String = text[at + 1..].chars().take_while(|letter| *letter != ')').collect();
            if inside.parse::<u32>().is_ok_and(|number| (1..=30).contains(&number)) {
                places.insert(format!("({inside})"));
            }
        }
        for word in ["Table ", "Fig. "] {
            for (at, _) in text.match_indices(word) {
                let number = text[at + word.len()..].split(|letter: char| !letter.is_ascii_alphanumeric());
                places.insert(format!("{word}{}", number.into_iter().next().unwrap_or_default()));
            }
        }
        places
    }

    /// The places that each mark in `text` names, in its own paragraph.
    fn marks(text: &str) -> Vec<BTreeSet<String>> {
        let lines: Vec<&str> = text.lines().collect();
        let is_comment = |line: &str| line.trim_start().starts_with("//");
        let is_blank = |line: &str| line.trim().trim_start_matches(['/', '!']).is_empty();
        let mut marks = Vec::new();
        for (at, line) in lines.iter().enumerate().filter(|(_, line)| line.contains(MARK)) {
            let ends = |line: &&&str| is_comment(line) && !is_blank(line) && !line.contains(MARK);
            let rest = lines[at + 1..].iter().take_while(ends).copied();
            let rest: Vec<&str> = if is_comment(line) { rest.collect() } else { Vec::new() };
            marks.push(places(&format!("{line} {}", rest.join(" "))));
        }
        marks
    }

    #[test]
    fn every_deviation_is_in_the_readme_and_every_one_there_is_in_the_code() {
        let readme = fs::read_to_string(root().join("README.md")).expect("readable");
        let table = readme.split("## Deviations from the print").nth(1).expect("the README lists deviations");
        let table = table.split("\n## ").next().expect("a section");
        let rows: Vec<(BTreeSet<String>, BTreeSet<&str>)> = table
            .lines()
            .filter(|line| line.starts_with("| ") && !line.starts_with("| place"))
            .map(|line| {
                let cells: Vec<&str> = line.trim_matches('|').split(" | ").collect();
                assert_eq!(cells.len(), 4, "{line}");
                let rooms = cells[3].split('`').map(str::trim).filter(|room| !room.is_empty());
                (places(cells[0]), rooms.collect())
            })
            .collect();
        assert!(rows.len() >= 10, "the table was read");
        let marked: Vec<(String, BTreeSet<String>)> = library()
            .into_iter()
            .flat_map(|(room, text)| marks(&text).into_iter().map(move |mark| (room.clone(), mark)))
            .collect();
        for (room, mark) in &marked {
            let listed = rows.iter().any(|(place, rooms)| {
                rooms.contains(room.as_str()) && place.intersection(mark).next().is_some()
            });
            assert!(listed, "src/{room}: the mark that names {mark:?} is not in the README's table");
        }
        for (place, rooms) in &rows {
            assert!(!rooms.is_empty(), "{place:?} names no room");
            for room in rooms {
                let found =
                    marked.iter().any(|(of, mark)| of == room && place.intersection(mark).next().is_some());
                assert!(found, "the README says that {place:?} is marked in src/{room}");
            }
        }
    }

    /// Numbers of the equations that the names of a file's tests carry: `eq_7_...`, `eqs_16_to_19_...`.
    fn tested(text: &str) -> BTreeSet<u32> {
        let mut numbers = BTreeSet::new();
        for name in text.split("fn eq").skip(1) {
            let words = name.trim_start_matches('s').trim_start_matches('_').split('_');
            let (mut last, mut is_range) = (0, false);
            for word in words.take_while(|word| matches!(*word, "to" | "and") || word.parse::<u32>().is_ok())
            {
                if let Ok(number) = word.parse::<u32>() {
                    numbers.extend(if is_range { last..=number } else { number..=number });
                    last = number;
                }
                is_range = word == "to";
            }
        }
        numbers
    }

    #[test]
    fn every_equation_used_has_its_test() {
        let tests: BTreeSet<u32> = ["tests/paper_lpc16.rs", "tests/paper_lpc16_identification.rs"]
            .iter()
            .flat_map(|file| tested(&fs::read_to_string(root().join(file)).expect("readable")))
            .collect();
        for (file, text) in library() {
            // Comments only: what stands in a string is for people.
            let comments = text.lines().filter_map(|line| line.split_once("//"));
            for cited in comments.filter_map(|(_, comment)| comment.split_once("[LPC16]")) {
                for place in places(cited.1).iter().filter(|place| place.starts_with('(')) {
                    let number: u32 = place.trim_matches(['(', ')']).parse().expect("a number");
                    assert!(
                        tests.contains(&number),
                        "src/{file} uses {place}, which no test carries in its name"
                    );
                }
            }
        }
        for number in [1, 2, 6, 9, 16, 20, 24, 27, 30] {
            assert!(tests.contains(&number), "({number}) was read");
        }
    }
}
