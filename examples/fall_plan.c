/* What a microcontroller does with a library of fall plans, here on a PC:
 *
 *   traceur fall compile --robot atlas --out plans
 *   fall_plan plans/two_feet-forward.fallplan -0.1 1.1 0.8
 *
 * plans a fall from theta [rad], r [m] and its rate [rad/s] at the moment the fall is noticed.
 */
#include <stdio.h>
#include <stdlib.h>

#include "traceur/fall/embedded/fall_plan.h"

static uint32_t flash[1 << 20]; /* 4 MB */

int main(int argc, char **argv) {
  const struct fall_library *library;
  struct fall_contact contact;
  enum fall_answer answer;
  if (argc != 5) {
    fprintf(stderr, "usage: fall_plan FILE THETA R THETA_RATE\n");
    return 2;
  }
  FILE *file = fopen(argv[1], "rb");
  if (!file) {
    fprintf(stderr, "fall_plan: cannot read %s\n", argv[1]);
    return 1;
  }
  const size_t size = fread(flash, 1, sizeof flash, file);
  fclose(file);
  const char *wrong = fall_open(flash, size, &library);
  if (wrong) {
    fprintf(stderr, "fall_plan: %s: %s\n", argv[1], wrong);
    return 1;
  }
  printf("%s, %s, %s: on %s\n", library->robot, library->stance, library->direction,
         fall_node(library, 0)->name);
  struct fall_state state = {0, 0, (float)atof(argv[2]), (float)atof(argv[3]),
                             (float)atof(argv[4])};
  while ((answer = fall_next(library, &state, &contact)) == FALL_CONTACT) {
    printf("%.2f s: %s, %.3g N s\n", (double)contact.next.time,
           fall_node(library, contact.node)->name, (double)contact.impulse);
    state = contact.next;
  }
  puts(answer == FALL_STOPS ? "stops" : "nothing stops it");
  return answer == FALL_STOPS ? 0 : 3;
}
