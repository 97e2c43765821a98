/* SPDX-License-Identifier: MIT */
/*
 * program_check and the rules of the header, for every header: no read outside of it, and what the checks of segments
 * and pieces start from. Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never
 * executed, touches nothing.
 *
 * prover: eva
 * options: -eva-domains equality,symbolic-locations
 * assumes: segment_check_all piece_check_all segment_length_check_all stop_check_all limit_check_all event_check_all
 * shows: program_check
 * mutant: core/program_check.c: i < NAME_SIZE && => i <= NAME_SIZE &&
 * mutant: core/program_check.c: h->length_q40_mm <= 0 || =>
 * mutant: core/program_check.c: period_us != 8000 => period_us > 8000
 */
#include "core/program_check.h"
#include "proof.h"

/*@ predicate good_header(struct program_header *h) =
      1000 <= h->period_us <= 8000 && 0 < h->length_q40_mm < (1 << 62); */

/*@ requires good_header(&p->header);
    assigns \result, *index \from *p, *limits;
    ensures \initialized(index); */
int segment_check_all(const struct program *p, const struct program_limits *limits,
                      uint32_t *index);

/*@ requires good_header(&p->header);
    assigns \result, *index \from *p, *limits;
    ensures \initialized(index); */
int piece_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index);

/*@ requires good_header(&p->header);
    assigns \result, *index \from *p, *limits;
    ensures \initialized(index); */
int stop_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index);

/*@ requires good_header(&p->header);
    assigns \result, *index \from *p;
    ensures \initialized(index); */
int segment_length_check_all(const struct program *p, uint32_t *index);

/*@ requires good_header(&p->header);
    assigns \result, *index \from *p;
    ensures \initialized(index); */
int event_check_all(const struct program *p, uint32_t *index);

/*@ assigns \result, *index \from *p, *limits;
    ensures \initialized(index); */
int limit_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index);

#include "core/program_check.c"

int main(void)
{
    static uint8_t image[PROGRAM_HEADER_SIZE -
                         16]; /* after the name only the reserved bytes are read */
    static uint8_t whole[PROGRAM_HEADER_SIZE];
    struct program p;
    struct program_limits limits;
    struct program_fault fault;
    Frama_C_make_unknown((char *)whole, sizeof whole);
    Frama_C_make_unknown((char *)image, sizeof image);
    Frama_C_make_unknown((char *)&limits, sizeof limits);
    Frama_C_make_unknown((char *)&p.header, sizeof p.header);
    p.image = whole;
    p.size = sizeof whole;
    name_is_padded(image + NAME_FROM);
    if (program_check(&p, &limits, &fault) == 0) {
        reached();
    }
    return 0;
}
