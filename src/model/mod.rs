//! Model file, actuator and body equations, simulation.
