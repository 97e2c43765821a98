/* SPDX-License-Identifier: MIT */
/* The length of frames: figures of host_tools/hodograph/bustime/frame_bits.py, which was written apart from this
 * one. Run by `make unit`; no I/O. */
#include "hub/frame_bits.h"
#include "unity.h"

static const struct {
    struct can_frame frame;
    unsigned bits;
} known[] = {
    {{.can_id = 0x00000080u, .can_dlc = 1, .data = {0x00}}, 58},
    {{.can_id = 0x00000000u, .can_dlc = 2, .data = {0x80, 0x00}}, 69},
    {{.can_id = 0x000007FFu,
      .can_dlc = 8,
      .data = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}},
     126},
    {{.can_id = 0x00000000u,
      .can_dlc = 8,
      .data = {0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00}},
     127},
    {{.can_id = 0x00000555u,
      .can_dlc = 8,
      .data = {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55}},
     112},
    {{.can_id = 0x00000123u, .can_dlc = 0, .data = {0}}, 48},
    {{.can_id = 0x92345678u,
      .can_dlc = 8,
      .data = {0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00}},
     145},
    {{.can_id = 0x9FFFFFFFu, .can_dlc = 3, .data = {0x01, 0x02, 0x03}}, 102},
    {{.can_id = 0x40000601u, .can_dlc = 8, .data = {0}}, 49},
    {{.can_id = 0x80000000u, .can_dlc = 0, .data = {0}}, 74},
    {{.can_id = 0x00000269u, .can_dlc = 5, .data = {0xCA, 0x00, 0xFF, 0x1D, 0x00}}, 90},
    {{.can_id = 0x000006F0u, .can_dlc = 1, .data = {0x00}}, 58},
    {{.can_id = 0x00000173u, .can_dlc = 3, .data = {0x00, 0x00, 0x1F}}, 77},
    {{.can_id = 0x000000CBu, .can_dlc = 6, .data = {0x00, 0xFF, 0x00, 0x3C, 0x9D, 0x00}}, 101},
    {{.can_id = 0x000005F5u, .can_dlc = 3, .data = {0x31, 0x20, 0x1E}}, 76},
    {{.can_id = 0x000007F1u, .can_dlc = 3, .data = {0xFF, 0xEE, 0xFF}}, 76},
    {{.can_id = 0x000003F9u, .can_dlc = 4, .data = {0x5C, 0x00, 0x99, 0xFF}}, 83},
    {{.can_id = 0x0000049Bu, .can_dlc = 7, .data = {0x00, 0x00, 0x00, 0xFF, 0x14, 0x27, 0xFF}},
     110},
    {{.can_id = 0x000007F2u, .can_dlc = 5, .data = {0x00, 0xFF, 0xF2, 0x00, 0x9E}}, 93},
    {{.can_id = 0x0000048Du, .can_dlc = 7, .data = {0xC5, 0x00, 0xFF, 0x56, 0xFF, 0x00, 0x00}},
     110},
};

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_known_frames(void)
{
    for (unsigned i = 0; i < sizeof known / sizeof known[0]; ++i) {
        TEST_ASSERT_EQUAL_UINT_MESSAGE(known[i].bits, frame_bits(&known[i].frame), "frame");
    }
}

static void test_an_error_frame_takes_no_time(void)
{
    const struct can_frame error = {.can_id = CAN_ERR_FLAG | 4u, .can_dlc = 8};
    TEST_ASSERT_EQUAL_UINT(0, frame_bits(&error));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_known_frames);
    RUN_TEST(test_an_error_frame_takes_no_time);
    return UNITY_END();
}
