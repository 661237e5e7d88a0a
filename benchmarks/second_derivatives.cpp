// What Pinocchio alone takes, in C++: first and second derivatives of the inverse dynamics.
//
//     second_derivatives JOINTS STATES ROUNDS
//
// JOINTS is a text file with the gravity and the joints of a model, written by limit.py. All
// is done ROUNDS times at STATES random states near zero. Prints JSON: the medians over the rounds
// of the CPU time per state in microseconds, and the sum of the torques at one state, to compare
// with Pinocchio in Python.

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "pinocchio/algorithm/rnea-derivatives.hpp"
#include "pinocchio/algorithm/rnea-second-order-derivatives.hpp"
#include "pinocchio/algorithm/rnea.hpp"
#include "pinocchio/multibody.hpp"

using State = std::vector<Eigen::VectorXd>;  // q, v, a

// A joint about or along z of its frame, by Pinocchio's short name of its kind.
pinocchio::JointModel joint(const std::string &kind) {
    if (kind == "JointModelRZ") return pinocchio::JointModelRZ();
    if (kind == "JointModelPZ") return pinocchio::JointModelPZ();
    throw std::runtime_error("no joint is expected of the kind " + kind);
}

// Numbers of a file, row by row.
template <int rows, int columns>
Eigen::Matrix<double, rows, columns> numbers(std::istream &file) {
    Eigen::Matrix<double, rows, columns> found;
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) file >> found(i, j);
    return found;
}

pinocchio::Model model_of(const std::string &path) {
    std::ifstream file(path);
    file.exceptions(std::ios::badbit | std::ios::failbit);
    pinocchio::Model model;
    model.gravity.linear(numbers<3, 1>(file));
    int count = 0;
    file >> count;
    for (int i = 0; i < count; ++i) {
        pinocchio::JointIndex parent = 0;
        std::string kind;
        double mass = 0.0;
        file >> parent >> kind;
        const auto rotation = numbers<3, 3>(file);
        const auto translation = numbers<3, 1>(file);
        file >> mass;
        const auto centre = numbers<3, 1>(file);
        const auto inertia = numbers<3, 3>(file);
        const auto place = pinocchio::SE3(rotation, translation);
        const auto id = model.addJoint(parent, joint(kind), place, "j" + std::to_string(i));
        model.appendBodyToJoint(id, pinocchio::Inertia(mass, centre, inertia));
    }
    return model;
}

// The median over the rounds of the CPU time per state; the first round only warms up.
template <typename Function>
double microseconds(const std::vector<State> &states, int rounds, Function evaluate) {
    std::vector<double> each;
    for (int round = 0; round <= rounds; ++round) {
        const std::clock_t start = std::clock();
        for (const State &state : states) evaluate(state);
        const double spent = 1e6 * (std::clock() - start) / CLOCKS_PER_SEC;
        if (round) each.push_back(spent / states.size());
    }
    std::sort(each.begin(), each.end());
    return each[each.size() / 2];
}

int main(int count, char **arguments) {
    if (count != 4) {
        std::cerr << "usage: second_derivatives JOINTS STATES ROUNDS\n";
        return 2;
    }
    const pinocchio::Model model = model_of(arguments[1]);
    pinocchio::Data data(model);
    const int n = model.nv, rounds = std::atoi(arguments[3]);

    std::srand(0);
    std::vector<State> states(std::atoi(arguments[2]));
    for (State &state : states)
        for (int part = 0; part < 3; ++part) state.push_back(0.3 * Eigen::VectorXd::Random(n));

    const double first = microseconds(states, rounds, [&](const State &s) {
        pinocchio::computeRNEADerivatives(model, data, s[0], s[1], s[2]);
    });
    const double second = microseconds(states, rounds, [&](const State &s) {
        pinocchio::ComputeRNEASecondOrderDerivatives(model, data, s[0], s[1], s[2]);
    });
    const Eigen::VectorXd all = Eigen::VectorXd::Constant(n, 0.1);
    std::cout << std::setprecision(15) << "{\"first_us\": " << first
              << ", \"second_us\": " << second
              << ", \"torque_sum\": " << pinocchio::rnea(model, data, all, all, all).sum()
              << "}\n";
}
