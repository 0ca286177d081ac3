// A trial under way. Each model is one class with the step that it takes.
#pragma once

#include "recorder.hpp"

class Flight {
public:
    explicit Flight(const Trial& trial)
        : trial(trial), flock(trial), recorder(trial, flock) {}
    virtual ~Flight() = default;

    // Takes all steps, and writes the end of the flock into the arrays of its start.
    // Returns whether all numbers were finite.
    bool fly() {
        for (i64 step = 0; step < trial.steps; ++step) {
            advance();
            if (!recorder.note(flock)) return false;
        }
        flock.write(trial);
        return true;
    }

protected:
    virtual void advance() = 0;

    Trial trial;
    Flock flock;
    Recorder recorder;
};

// The flight of a model whose `Model::Settings` are doubles alone; null where Python
// has another number of them.
template <class Model>
Flight* begin(const Trial* trial) {
    const i64 known = sizeof(typename Model::Settings) / sizeof(double);
    return trial->number_of_settings == known ? new Model(*trial) : nullptr;
}

template <class Settings>
const Settings& settings_of(const Trial& trial) {
    return *reinterpret_cast<const Settings*>(trial.settings);
}
