#include "traceur/reproduce/table.h"
namespace traceur::reproduce {
const std::vector<Table>& allTables() {
  static const std::vector<Table> k;
  return k;
}
}  // namespace traceur::reproduce
