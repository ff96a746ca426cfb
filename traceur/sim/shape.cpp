#include "traceur/sim/shape.h"

#include <cmath>

namespace traceur::sim {

using Eigen::Vector3d;

std::optional<Vector3d> farthestPoint(const mjModel* m, const mjData* d, int geom,
                                      const Vector3d& u) {
  using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Vector3d p(d->geom_xpos + 3 * static_cast<ptrdiff_t>(geom));
  const Rotation R(d->geom_xmat + 9 * static_cast<ptrdiff_t>(geom));
  const Vector3d s(m->geom_size + 3 * static_cast<ptrdiff_t>(geom));
  const Vector3d l = R.transpose() * u;  // u in the geom's axes
  const auto along = [&](int axis) -> Vector3d {
    return R.col(axis) * (l[axis] < 0 ? -s[axis] : s[axis]);
  };
  switch (m->geom_type[geom]) {
    case mjGEOM_SPHERE:
      return p + s[0] * u;
    case mjGEOM_CAPSULE:
      return p + s[0] * u + R.col(2) * (l.z() < 0 ? -s[1] : s[1]);
    case mjGEOM_CYLINDER: {
      const double radial = std::hypot(l.x(), l.y());
      const Vector3d rim =
          radial > 0 ? Vector3d(R * Vector3d(l.x(), l.y(), 0) * (s[0] / radial)) : Vector3d::Zero();
      return p + rim + R.col(2) * (l.z() < 0 ? -s[1] : s[1]);
    }
    case mjGEOM_ELLIPSOID: {
      const Vector3d scaled = s.cwiseProduct(l);
      return p + R * s.cwiseProduct(scaled) / scaled.norm();
    }
    case mjGEOM_BOX:
      return p + along(0) + along(1) + along(2);
    case mjGEOM_MESH: {
      const int mesh = m->geom_dataid[geom];
      const float* vertices = m->mesh_vert + 3 * static_cast<ptrdiff_t>(m->mesh_vertadr[mesh]);
      std::optional<Vector3d> farthest;
      double most = 0;
      for (int k = 0; k < m->mesh_vertnum[mesh]; ++k) {
        const float* x = vertices + 3 * static_cast<ptrdiff_t>(k);
        const double reach = l.x() * x[0] + l.y() * x[1] + l.z() * x[2];
        if (farthest && reach <= most) continue;
        most = reach;
        farthest = p + R.col(0) * x[0] + R.col(1) * x[1] + R.col(2) * x[2];
      }
      return farthest;
    }
    default:
      return std::nullopt;
  }
}

}  // namespace traceur::sim
