// A program that `urdfkin verify --program` checks: the Jacobian of planar_two_link, written by hand.
//
//     g++ -O2 planar.cpp -o planar
//     urdfkin verify ./planar planar_two_link --program --quantity jacobian
//
// Each line of standard input is a JSON object with "q"; each line of standard output is {"result": [...]}.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>

int main() {
    std::string line;
    while (std::getline(std::cin, line)) {
        const char *at = line.c_str() + line.find("\"q\"");
        double q[2];
        for (double &x : q) {
            at += std::strcspn(at, "[,") + 1;
            x = std::strtod(at, nullptr);
        }
        const double s1 = 0.5 * std::sin(q[0]), c1 = 0.5 * std::cos(q[0]);
        const double s2 = 0.4 * std::sin(q[0] + q[1]), c2 = 0.4 * std::cos(q[0] + q[1]);
        const double J[6][2] = {{-s1 - s2, -s2}, {c1 + c2, c2}, {0, 0}, {0, 0}, {0, 0}, {1, 1}};
        std::printf("{\"result\": [");
        for (int i = 0; i < 6; ++i) std::printf("%s[%.17g, %.17g]", i ? ", " : "", J[i][0], J[i][1]);
        std::printf("]}\n");
        std::fflush(stdout);
    }
}
