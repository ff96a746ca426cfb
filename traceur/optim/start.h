// Where a search begins and in what units it steps, from a problem's box.
#pragma once

#include <string_view>

#include "traceur/optim/problem.h"

namespace traceur::optim {

struct Start {
  VectorXd x0;     ///< (n) the first mean
  VectorXd scale;  ///< (n) the unit of each variable's first step
};

/// The unit of a variable with two bounds is their distance, of others 1.
/// @param x0  (n), or empty: the middle of two bounds, 1 inside a single one, 0 without
/// @throws InputError for bounds that are NaN or reversed, or x0 of another size
Start startOf(const Problem& problem, const VectorXd& x0 = {});

/// Checks where a search begins and fills in what was left out: empty scale 1, empty bounds ±∞.
/// @param who    begins the message
/// @param sigma  the first standard deviation, in units of scale
/// @throws InputError for no variables, sizes that differ, numbers that are not finite, σ or scale
///         not positive, bounds that are NaN or reversed, or x0 outside them
void completeStart(std::string_view who, const VectorXd& x0, double sigma, VectorXd& scale,
                   VectorXd& lower, VectorXd& upper);

}  // namespace traceur::optim
