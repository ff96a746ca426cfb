// A tunable number, declared once: the optimiser's bounds, the file's checks and the docs' table
// all read this row.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace traceur {

struct ParamSpec {
  std::string name;
  std::string unit;    ///< SI, as printed: "rad", "N"; "" for a pure number
  double min = 0;      ///< in unit
  double max = 0;      ///< in unit, > min
  double initial = 0;  ///< in unit, min ≤ initial ≤ max
  std::string help;    ///< one sentence
};

using ParamSpecs = std::vector<ParamSpec>;

/// (n) one number of each row, in order.
inline Eigen::VectorXd columnOf(const ParamSpecs& rows, double ParamSpec::*number) {
  Eigen::VectorXd x(static_cast<Eigen::Index>(rows.size()));
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = rows[static_cast<size_t>(i)].*number;
  return x;
}
inline Eigen::VectorXd lowerOf(const ParamSpecs& rows) {
  return columnOf(rows, &ParamSpec::min);
}
inline Eigen::VectorXd upperOf(const ParamSpecs& rows) {
  return columnOf(rows, &ParamSpec::max);
}
inline Eigen::VectorXd initialOf(const ParamSpecs& rows) {
  return columnOf(rows, &ParamSpec::initial);
}

}  // namespace traceur
