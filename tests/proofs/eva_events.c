/* SPDX-License-Identifier: MIT */
/*
 * The rules of events, for up to twenty of them of any contents: no event is read that the image does not have.
 * Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-domains equality,symbolic-locations -eva-slevel 2000
 * assumes: length_exceeds_tick
 * shows: event_check_all program_event_get program_event_place
 * mutant: core/event_check.c: *index = 0; *index < p->header => *index = 0; *index <= p->header
 * mutant: core/event_check.c: *index - PROGRAM_EVENTS_A_TICK) => *index + PROGRAM_EVENTS_A_TICK)
 * mutant: core/event_check.c: i > 0u ? => i >= 0u ?
 */
#include "core/event_check.h"
#include "proof.h"

/*@ assigns \result, *first \from *p;
    ensures \initialized(first); */
int length_exceeds_tick(const struct program *p, int64_t from_q40_mm, int64_t to_q40_mm,
                         uint32_t *first);

#include "core/event_check.c"
#include "core/program.c"

#define MOST 20u

static uint8_t image[MOST * PROGRAM_EVENT_SIZE];

static void count_of(uint32_t events)
{
    struct program p;
    uint32_t index;
    Frama_C_make_unknown((char *)&p.header, sizeof p.header);
    p.header.header_size = 0;
    p.header.segment_count = 0;
    p.header.piece_count = 0;
    p.header.axis_count = PROGRAM_PLANE;
    p.header.event_count = events;
    p.image = image + (MOST - events) * PROGRAM_EVENT_SIZE;
    if (event_check_all(&p, &index) == 0) {
        reached();
    }
}

int main(void)
{
    Frama_C_make_unknown((char *)image, sizeof image);
    count_of(0);
    count_of(1);
    count_of(MOST);
    return 0;
}
