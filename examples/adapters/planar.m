% A program that `urdfkin verify --program` checks: the Jacobian of planar_two_link, for Octave.
%
%     urdfkin verify "octave -q planar.m" planar_two_link --program --quantity jacobian
%
% Each line of standard input is a JSON object with "q"; each line of standard output is {"result": [...]}.
while true
  line = input("", "s");  % fgetl would wait for the next line
  q = jsondecode(line).q;
  s = sin(cumsum(q(:)))' .* [0.5 0.4];
  c = cos(cumsum(q(:)))' .* [0.5 0.4];
  J = zeros(6, 2);
  J(1, :) = [-sum(s), -s(2)];
  J(2, :) = [sum(c), c(2)];
  J(6, :) = 1;
  rows = arrayfun(@(i) sprintf("[%.17g, %.17g]", J(i, :)), 1:6, "UniformOutput", false);
  printf("{\"result\": [%s]}\n", strjoin(rows, ", "));
  fflush(stdout);
end
