# Writes the decks of this folder: a skewed block of 2 x 1 x 1 cells of each solid element type, with one fixed face, in mm, t, s.
# CalculiX (ccx) computes the stiffness eigenvalues that the test expects.
import itertools
import subprocess

import numpy as np

size=(30.,14.,10.)
N=(2,1,1)
def warp(p):
    x,y,z=p
    return (x+0.05*y+0.02*z*y/10, y+0.08*x*z/30-0.03*x, z+0.06*x+0.04*y*x/30)
EDGES=[(0,1),(1,2),(2,3),(3,0),(4,5),(5,6),(6,7),(7,4),(0,4),(1,5),(2,6),(3,7)]
TE=[(0,1),(1,2),(2,0),(0,3),(1,3),(2,3)]
WE=[(0,1),(1,2),(2,0),(3,4),(4,5),(5,3),(0,3),(1,4),(2,5)]
def mesh(kind,N=N,size=size):
    nodes={};els=[]
    def node(p):
        key=tuple(round(v,9) for v in p)
        return nodes.setdefault(key,len(nodes)+1)
    for i,j,k in itertools.product(*(range(n) for n in N)):
        c=[(i+a,j+b,k+d) for a,b,d in [(0,0,0),(1,0,0),(1,1,0),(0,1,0),(0,0,1),(1,0,1),(1,1,1),(0,1,1)]]
        c=[tuple(size[d]*p[d]/N[d] for d in range(3)) for p in c]
        mid=lambda a,b: tuple((a[d]+b[d])/2 for d in range(3))
        if kind.startswith('C3D8'): els.append([node(p) for p in c])
        elif kind.startswith('C3D20'): els.append([node(p) for p in c+[mid(c[a],c[b]) for a,b in EDGES]])
        elif kind in ('C3D6','C3D15'):
            for t in [(0,1,2,4,5,6),(0,2,3,4,6,7)]:
                q=[c[v] for v in t]
                els.append([node(p) for p in (q if kind=='C3D6' else q+[mid(q[a],q[b]) for a,b in WE])])
        else:
            for t in [(0,1,3,7),(0,1,7,4),(1,5,7,4),(1,5,6,7),(1,6,2,7),(1,2,3,7)]:
                q=[c[v] for v in t]
                # The volume must be positive.
                m=np.array([np.array(q[v])-np.array(q[0]) for v in (1,2,3)])
                if np.linalg.det(m)<0: q[1],q[2]=q[2],q[1]
                els.append([node(p) for p in (q if kind=='C3D4' else q+[mid(q[a],q[b]) for a,b in TE])])
    return {n:warp(p) for p,n in nodes.items()}, {n:p for p,n in nodes.items()}, els
def roots(name,count):
    subprocess.run(['ccx',name],capture_output=True)
    dof=[tuple(map(int,l.split('.'))) for l in open(name+'.dof').read().split()]
    K=np.zeros((len(dof),)*2)
    for line in open(name+'.sti'):
        i,j,v=line.split()
        K[int(i)-1,int(j)-1]=K[int(j)-1,int(i)-1]=float(v)
    own=[i for i,(node,_) in enumerate(dof) if node<=count]
    rest=[i for i,(node,_) in enumerate(dof) if node>count]
    S=K[np.ix_(own,own)]
    if rest:
        S=S-K[np.ix_(own,rest)]@np.linalg.solve(K[np.ix_(rest,rest)],K[np.ix_(rest,own)])
    return " ".join(f"{v:.12g}" for v in np.sqrt(np.linalg.eigvalsh(S)[:5])/(2*np.pi))
for kind in ['C3D8','C3D8I','C3D20','C3D20R','C3D6','C3D15','C3D4','C3D10']:
    nodes,flat,els=mesh(kind)
    with open(kind+'.inp','w') as f:
        f.write('*NODE\n'+''.join(f'{n},{x:.12g},{y:.12g},{z:.12g}\n' for n,(x,y,z) in nodes.items()))
        f.write(f'*ELEMENT, TYPE={kind}, ELSET=EALL\n')
        for e,ns in enumerate(els,1):
            row=[e]+ns
            f.write(',\n'.join(','.join(map(str,row[i:i+16])) for i in range(0,len(row),16))+'\n')
        f.write('*NSET, NSET=FOOT\n'+''.join(f'{n},\n' for n,p in flat.items() if p[0]==0))
        f.write('*MATERIAL, NAME=STEEL\n*ELASTIC\n198400.,0.3\n*DENSITY\n7.949E-9\n*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n*BOUNDARY\nFOOT,1,3\n*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n5\n*END STEP\n')
    print(kind,roots(kind,len(nodes)))

# Two blocks with nonmatching meshes. A tie connects the blocks over a gap of 0.05 mm, and an equation couples two upper corners.
def lines(e,ns):
    row=[e]+ns
    return ',\n'.join(','.join(map(str,row[i:i+16])) for i in range(0,len(row),16))+'\n'
for name,below,above in [('tied','C3D8','C3D8'),('tied_quadratic','C3D20','C3D10')]:
    _,low,els_low=mesh(below,(3,2,1),(30.,14.,10.))
    _,high,els_high=mesh(above,(2,3,1),(26.,11.,8.))
    first=len(low)
    high={n+first:(p[0]+1.7,p[1]+1.1,p[2]+10.05) for n,p in high.items()}
    els_high=[[n+first for n in ns] for ns in els_high]
    nodes=low|high
    with open(name+'.inp','w') as f:
        f.write('*NODE\n'+''.join(f'{n},{x:.12g},{y:.12g},{z:.12g}\n' for n,(x,y,z) in nodes.items()))
        f.write(f'*ELEMENT, TYPE={below}, ELSET=LOW\n'+''.join(lines(e,ns) for e,ns in enumerate(els_low,1)))
        f.write(f'*ELEMENT, TYPE={above}, ELSET=HIGH\n'+''.join(lines(e,ns) for e,ns in enumerate(els_high,101)))
        f.write('*NSET, NSET=FOOT\n'+''.join(f'{n},\n' for n,p in low.items() if p[0]==0))
        f.write('*NSET, NSET=SOLE\n'+''.join(f'{n},\n' for n,p in high.items() if p[2]==10.05))
        f.write('*SURFACE, NAME=SLAVE, TYPE=NODE\nSOLE\n*SURFACE, NAME=MASTER\nLOW,S2\n')
        f.write('*TIE, NAME=GLUE, POSITION TOLERANCE=0.1\nSLAVE,MASTER\n')
        ends=sorted(n for n,p in high.items() if p[2]==18.05 and p[0]==27.7 and p[1] in (1.1,12.1))
        f.write(f'*EQUATION\n3\n{ends[0]},3,1.0,{ends[1]},3,-0.75,{ends[1]},1,0.5\n')
        f.write('*MATERIAL, NAME=STEEL\n*ELASTIC\n198400.,0.3\n*DENSITY\n7.949E-9\n')
        f.write('*SOLID SECTION, ELSET=LOW, MATERIAL=STEEL\n*SOLID SECTION, ELSET=HIGH, MATERIAL=STEEL\n')
        f.write('*BOUNDARY\nFOOT,1,3\n*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n5\n*END STEP\n')
    print(name,roots(name,len(nodes)))
