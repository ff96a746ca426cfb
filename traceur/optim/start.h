// Where a search begins and in what units it steps, from a problem's box.
#pragma once

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

}  // namespace traceur::optim
