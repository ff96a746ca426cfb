#include "traceur/optim/svm_classifier.h"

#include <libsvm/svm.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace traceur::optim {

SvmClassifier::SvmClassifier(const Eigen::MatrixXd& X, const std::vector<bool>& inside,
                             const SvmOptions& options)
    : gamma_(options.gamma) {
  static const bool kQuiet = [] {
    svm_set_print_string_function([](const char*) {});
    return true;
  }();
  static_cast<void>(kQuiet);

  const auto n = static_cast<int>(X.rows());
  const auto count = static_cast<int>(X.cols());
  const auto positive = static_cast<double>(std::count(inside.begin(), inside.end(), true));
  assert(positive > 0 && positive < count);

  // LIBSVM's sparse rows, each ended by index -1.
  std::vector<svm_node> nodes(static_cast<size_t>(count) * (n + 1));
  std::vector<svm_node*> rows(count);
  std::vector<double> labels(count);
  for (int k = 0; k < count; ++k) {
    rows[k] = &nodes[static_cast<size_t>(k) * (n + 1)];
    for (int i = 0; i < n; ++i) rows[k][i] = {i + 1, X(i, k)};
    rows[k][n] = {-1, 0};
    labels[k] = inside[k] ? 1 : -1;
  }
  int classes[] = {1, -1};
  double weights[] = {count / (2 * positive), count / (2 * (count - positive))};
  svm_parameter parameter = {};
  parameter.svm_type = C_SVC;
  parameter.kernel_type = RBF;
  parameter.gamma = options.gamma;
  parameter.C = options.C;
  parameter.cache_size = 16;  // MB
  // Ten times LIBSVM's default: a hard margin with a wide kernel is ill-conditioned, and its single
  // precision may never get closer. Ranks of decision values are what counts here.
  parameter.eps = 1e-2;
  parameter.shrinking = 1;
  if (options.balanced) {
    parameter.nr_weight = 2;
    parameter.weight_label = classes;
    parameter.weight = weights;
  }
  svm_problem problem = {count, labels.data(), rows.data()};
  svm_model* model = svm_train(&problem, &parameter);

  // The decision values of the model are positive for the label it saw first.
  const double sign = model->label[0] == 1 ? 1 : -1;
  rho_ = sign * model->rho[0];
  support_.resize(n, model->l);
  coefficients_.resize(model->l);
  for (int k = 0; k < model->l; ++k) {
    support_.col(k) = X.col(model->sv_indices[k] - 1);
    coefficients_[k] = sign * model->sv_coef[0][k];
  }
  svm_free_and_destroy_model(&model);
}

double SvmClassifier::decision(const Eigen::VectorXd& x) const {
  double sum = -rho_;
  for (int k = 0; k < coefficients_.size(); ++k) {
    sum += coefficients_[k] * std::exp(-gamma_ * (x - support_.col(k)).squaredNorm());
  }
  return sum;
}

}  // namespace traceur::optim
