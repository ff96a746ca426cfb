// Tables of fall plans as a microcontroller reads them: the seal is made right, so that what is
// behind it is reached.
#include "traceur/fall/embedded/fall_plan.h"

#include <cstring>
#include <vector>

#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  std::vector<std::uint32_t> words((size + 3) / 4);  // exactly as large as it is aligned
  std::memcpy(words.data(), data, size);
  auto* bytes = reinterpret_cast<char*>(words.data());
  const std::size_t whole = words.size() * 4;
  if (whole >= sizeof(fall_library)) {
    auto* l = reinterpret_cast<fall_library*>(bytes);
    std::memcpy(l->magic, FALL_LIBRARY_MAGIC, sizeof l->magic);
    l->version = FALL_LIBRARY_VERSION;
    l->size = static_cast<std::uint32_t>(whole);
    constexpr std::size_t kSummed = offsetof(fall_library, problem);
    l->checksum = fall_checksum(bytes + kSummed, whole - kSummed);
  }
  const fall_library* library = nullptr;
  if (fall_open(bytes, whole, &library) != nullptr) return 0;
  for (std::uint32_t node = 0; node < library->nodes && node < 2; ++node) {
    const fall_library_node* n = fall_node(library, node);
    for (const float theta_rate : {0.1F, 2.0F}) {
      fall_state state{node, 0, 0.1F, (n->r.min + n->r.max) / 2, theta_rate};
      fall_contact contact;
      for (int k = 0; k < 2 && fall_next(library, &state, &contact) == FALL_CONTACT; ++k) {
        state = contact.next;
      }
    }
  }
  return 0;
}
