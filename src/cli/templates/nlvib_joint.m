function [M, D, K, nonlinear_elements, Fex1] = nlvib_joint()
% Reads a joint exported by fretwear for NLvib: mass, damping and stiffness, nonlinear elements, and the load of the first harmonic.
% Needs contact.csv, loads.csv, K.mtx, M.mtx and, with damping, C.mtx of the same export in the folder of this file. Hysteretic damping (Ks.mtx) and loads
% of harmonics other than the first are ignored.
%
% Friction has a constant limit, mu times the load at rest, separately along x and y. A slider that bears load is a linear spring across the joint, added to K, and a
% unilateral spring of stiffness -kn that cancels it after lift-off. A slider that is open at rest is a unilateral spring with a gap, without friction. No element has a
% force at rest.
here = fileparts(mfilename('fullpath'));
M = matrix(fullfile(here, 'M.mtx'));
K = matrix(fullfile(here, 'K.mtx'));
D = zeros(size(M));
if exist(fullfile(here, 'C.mtx'), 'file')
    D = matrix(fullfile(here, 'C.mtx'));
end
if exist(fullfile(here, 'Ks.mtx'), 'file')
    warning('fretwear:hysteretic', 'NLvib has no hysteretic damping: Ks.mtx is ignored');
end
rows = table_of(fullfile(here, 'contact.csv'));
n = size(K, 1);
nonlinear_elements = {};
for r = 1:size(rows, 1)
    element = rows(r, 1);
    mu = rows(r, 5);
    load = rows(r, 8);
    gap = rows(r, 9);
    kn = rows(r, 10);
    kt = rows(r, 11);
    for axis = 1:2
        if kt > 0 && mu * load > 0
            nonlinear_elements{end+1} = struct('type', 'elasticDryFriction', 'stiffness', kt, 'friction_limit_force', mu * load, ...
                'ishysteretic', true, 'force_direction', direction(n, element, axis)); %#ok<AGROW>
        end
    end
    % The displacement along n is positive when the joint opens.
    w = direction(n, element, 3);
    if kn > 0 && load > 0
        K = K + kn * (w * w');
        nonlinear_elements{end+1} = struct('type', 'unilateralSpring', 'stiffness', -kn, 'gap', load / kn, 'ishysteretic', false, ...
            'force_direction', w); %#ok<AGROW>
    elseif kn > 0
        nonlinear_elements{end+1} = struct('type', 'unilateralSpring', 'stiffness', kn, 'gap', gap, 'ishysteretic', false, ...
            'force_direction', -w); %#ok<AGROW>
    end
end
Fex1 = zeros(n, 1);
loads = table_of(fullfile(here, 'loads.csv'));
for r = 1:size(loads, 1)
    if loads(r, 2) == 1
        Fex1(loads(r, 1)) = Fex1(loads(r, 1)) + loads(r, 3) - 1i * loads(r, 4);
    end
end
end

function w = direction(n, element, axis)
w = zeros(n, 1);
w(3 * element + axis) = 1;
end

function rows = table_of(path)
% Reads the numbers below the comment lines and the line of names.
file = fopen(path, 'r');
line = fgetl(file);
while line(1) == '#'
    line = fgetl(file);
end
columns = numel(strfind(line, ',')) + 1;
rows = fscanf(file, [repmat('%f,', 1, columns - 1), '%f\n'], [columns, Inf])';
fclose(file);
end

function A = matrix(path)
% Reads a symmetric Matrix Market file, which stores the lower triangle.
file = fopen(path, 'r');
line = fgetl(file);
while line(1) == '%'
    line = fgetl(file);
end
sizes = sscanf(line, '%f');
entries = fscanf(file, '%f %f %f', [3, Inf])';
fclose(file);
A = full(sparse(entries(:, 1), entries(:, 2), entries(:, 3), sizes(1), sizes(2)));
A = A + A' - diag(diag(A));
end
