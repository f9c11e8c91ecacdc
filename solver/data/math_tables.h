// Tables of exponentials.cpp and angles.cpp: what is named, rounded to a double, and what that leaves of it.
#pragma once

#include <cstdint>
#include <limits>

#include "solver/data/two_part_numbers.h"

namespace sunder::math {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Rows of tables.
// clang-format off

// 2^(j/32)
constexpr TwoPart kRoots[32] = {
    {0x1p0, 0x0p0}, {0x1.059b0d3158574p0, 0x1.d73e2a475b465p-55}, {0x1.0b5586cf9890fp0, 0x1.8a62e4adc610bp-54},
    {0x1.11301d0125b51p0, -0x1.6c51039449b3ap-54}, {0x1.172b83c7d517bp0, -0x1.19041b9d78a76p-55},
    {0x1.1d4873168b9aap0, 0x1.e016e00a2643cp-54}, {0x1.2387a6e756238p0, 0x1.9b07eb6c70573p-54},
    {0x1.29e9df51fdee1p0, 0x1.612e8afad1255p-55}, {0x1.306fe0a31b715p0, 0x1.6f46ad23182e4p-55},
    {0x1.371a7373aa9cbp0, -0x1.63aeabf42eae2p-54}, {0x1.3dea64c123422p0, 0x1.ada0911f09ebcp-55},
    {0x1.44e086061892dp0, 0x1.89b7a04ef80dp-59}, {0x1.4bfdad5362a27p0, 0x1.d4397afec42e2p-56},
    {0x1.5342b569d4f82p0, -0x1.07abe1db13cadp-55}, {0x1.5ab07dd485429p0, 0x1.6324c054647adp-54},
    {0x1.6247eb03a5585p0, -0x1.383c17e40b497p-54}, {0x1.6a09e667f3bcdp0, -0x1.bdd3413b26456p-54},
    {0x1.71f75e8ec5f74p0, -0x1.16e4786887a99p-55}, {0x1.7a11473eb0187p0, -0x1.41577ee04992fp-55},
    {0x1.82589994cce13p0, -0x1.d4c1dd41532d8p-54}, {0x1.8ace5422aa0dbp0, 0x1.6e9f156864b27p-54},
    {0x1.93737b0cdc5e5p0, -0x1.75fc781b57ebcp-57}, {0x1.9c49182a3f09p0, 0x1.c7c46b071f2bep-56},
    {0x1.a5503b23e255dp0, -0x1.d2f6edb8d41e1p-54}, {0x1.ae89f995ad3adp0, 0x1.7a1cd345dcc81p-54},
    {0x1.b7f76f2fb5e47p0, -0x1.5584f7e54ac3bp-56}, {0x1.c199bdd85529cp0, 0x1.11065895048ddp-55},
    {0x1.cb720dcef9069p0, 0x1.503cbd1e949dbp-56}, {0x1.d5818dcfba487p0, 0x1.2ed02d75b3707p-55},
    {0x1.dfc97337b9b5fp0, -0x1.1a5cd4f184b5cp-54}, {0x1.ea4afa2a490dap0, -0x1.e9c23179c2893p-54},
    {0x1.f50765b6e454p0, 0x1.9d3e12dd8a18bp-54}};

// log c for c = 1 + j/64, of half of it from j = 27 on; upper parts are multiples of 2^-42
constexpr TwoPart kLogs[65] = {
    {0x0p0, 0x0p0}, {0x1.fc0a8b0fcp-7, 0x1.f1e7cf6d3a69cp-50}, {0x1.f829b0e78p-6, 0x1.980267c7e09e4p-45},
    {0x1.77458f633p-5, -0x1.181dce586af09p-44}, {0x1.f0a30c0118p-5, -0x1.d599e83368e91p-45},
    {0x1.341d7961bcp-4, 0x1.1d0929983761p-44}, {0x1.6f0d28ae58p-4, -0x1.4b4641b664613p-44},
    {0x1.a926d3a4acp-4, 0x1.563650bd22a9cp-44}, {0x1.e27076e2bp-4, -0x1.a342c2af0003cp-45},
    {0x1.0d77e7cd08p-3, 0x1.cb2cd2ee2f482p-44}, {0x1.29552f82p-3, -0x1.5b967f4471dfcp-44},
    {0x1.44d2b6ccb8p-3, -0x1.70cc16135783cp-46}, {0x1.5ff3070a7ap-3, -0x1.8586f183bebf2p-44},
    {0x1.7ab890210ep-3, -0x1.bdb9072534a58p-45}, {0x1.9525a9cf46p-3, -0x1.297137d9f158fp-44},
    {0x1.af3c94e80cp-3, -0x1.a4e633fcd9066p-52}, {0x1.c8ff7c79aap-3, -0x1.7794f689f8434p-45},
    {0x1.e27076e2bp-3, -0x1.a342c2af0003cp-44}, {0x1.fb9186d5e4p-3, -0x1.d572aab993c87p-47},
    {0x1.0a324e2739p-2, 0x1.c6bee7ef4030ep-47}, {0x1.1675cababap-2, 0x1.8380e731f55c4p-44},
    {0x1.22941fbcf8p-2, -0x1.a6976f5eb0963p-44}, {0x1.2e8e2bae12p-2, -0x1.67b1e99b72bd8p-45},
    {0x1.3a64c55694p-2, 0x1.7a71cbcd735dp-44}, {0x1.4618bc21c6p-2, -0x1.3d82f484c84ccp-46},
    {0x1.51aad872ep-2, -0x1.f4bd8db0a7cc1p-44}, {0x1.5d1bdbf581p-2, -0x1.8d6bdc9c7c238p-44},
    {-0x1.5d5bddf596p-2, 0x1.a0b2a08a465dcp-47}, {-0x1.522ae0738ap-2, -0x1.ebe708164c759p-45},
    {-0x1.4718dc271cp-2, -0x1.06c18fb4c14c5p-44}, {-0x1.3c25277333p-2, -0x1.83b54b606bd5cp-46},
    {-0x1.314f1e1d36p-2, 0x1.8e27ad3213cb8p-45}, {-0x1.269621134ep-2, 0x1.1b61f10522625p-44},
    {-0x1.1bf99635a7p-2, 0x1.1ac89575c2125p-44}, {-0x1.1178e8227ep-2, -0x1.1ef78ce2d07f2p-44},
    {-0x1.07138604d6p-2, 0x1.e76324e912b17p-44}, {-0x1.f991c6cb3cp-3, 0x1.90d04cd7cc834p-44},
    {-0x1.e530effe72p-3, 0x1.fdbdbb13f7c18p-44}, {-0x1.d1037f2656p-3, 0x1.84a7e75b6f6e4p-47},
    {-0x1.bd087383bep-3, 0x1.d4bc4595412b6p-45}, {-0x1.a93ed3c8aep-3, 0x1.8724350562169p-45},
    {-0x1.95a5adcf7p-3, -0x1.7f22858a0ff6fp-47}, {-0x1.823c16551ap-3, -0x1.e0ddb9a631e83p-46},
    {-0x1.6f0128b756p-3, -0x1.577390d31ef0fp-44}, {-0x1.5bf406b544p-3, 0x1.27023eb68981cp-46},
    {-0x1.4913d8333cp-3, 0x1.53e43558124c4p-44}, {-0x1.365fcb015ap-3, 0x1.fd3a0afb9691bp-44},
    {-0x1.23d712a49cp-3, -0x1.00d238fd3df5cp-46}, {-0x1.1178e8227ep-3, -0x1.1ef78ce2d07f2p-45},
    {-0x1.fe89139dbcp-4, -0x1.56594d82f7a82p-44}, {-0x1.da72763844p-4, -0x1.a89401fa71733p-46},
    {-0x1.b6ac88dad4p-4, -0x1.b1bdff50225c7p-44}, {-0x1.9335e5d594p-4, -0x1.3115c3abd47dap-45},
    {-0x1.700d30aeacp-4, -0x1.c1e8da99ded32p-49}, {-0x1.4d3115d208p-4, 0x1.53a2582f4e1efp-48},
    {-0x1.2aa04a447p-4, -0x1.7a48ba8b1cb41p-44}, {-0x1.08598b59e4p-4, 0x1.7e5dd7009902cp-46},
    {-0x1.ccb73cddd8p-5, -0x1.965c36e09f5fep-44}, {-0x1.894aa149f8p-5, -0x1.9a19a8be97661p-44},
    {-0x1.466aed42ep-5, 0x1.c167375bdfd28p-45}, {-0x1.0415d89e78p-5, 0x1.dddc7f461c516p-44},
    {-0x1.8492528c9p-6, 0x1.aa0ba325a0c34p-45}, {-0x1.020565893p-6, -0x1.611d27c8e8417p-44},
    {-0x1.010157588p-7, -0x1.bce251998b506p-44}, {0x0p0, 0x0p0}};

// atan(j/16)
constexpr TwoPart kArcs[17] = {
    {0x0p0, 0x0p0}, {0x1.ff55bb72cfdeap-5, -0x1.c934d86d23f1dp-60}, {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
    {0x1.7b97b4bce5b02p-3, 0x1.347b0b4f881cap-58}, {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
    {0x1.362773707ebccp-2, -0x1.963a544b672d8p-57}, {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
    {0x1.a64eec3cc23fdp-2, -0x1.24dec1b50b7ffp-56}, {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
    {0x1.0657e94db30dp-1, -0x1.d5b495f6349e6p-56}, {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
    {0x1.345f01cce37bbp-1, 0x1.1021137c71102p-55}, {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
    {0x1.5d58987169b18p-1, 0x1.0028e4bc5e7cap-57}, {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
    {0x1.819d0b7158a4dp-1, -0x1.bf76229d3b917p-56}, {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}};

// 2/pi in binary, after a word of zeros; enough for the largest of all doubles.
constexpr uint64_t kTwoOverPi[20] = {
    0, 0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561, 0xb7246e3a424dd2e0,
    0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484, 0xe99c7026b45f7e41, 0x3991d639835339f4,
    0x9c845f8bbdf9283b, 0x1ff897ffde05980f, 0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7, 0x4f463f669e5fea2d,
    0x7527bac7ebe5f17b, 0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab};
// clang-format on

}  // namespace sunder::math
